"""Vertical load, temperature and a step scale the forces that they act on, against exact values."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from excitations import LAYER, Excitation, equal_cycles, layer_force, usual_values

from core.effect import KINDS, SCALES, Effect, LogNormal, Parameter
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.isolator import Conditions
from core.model.program import compiled_force, in_opcode_order

RATE = 400.0
SPEED = 0.1
"""m/s."""
BOUC_WEN = {"bouc_wen": LAYER["bouc_wen"]}
SLIDING = {"friction": usual_values("friction", sliding=1e6, share=0.5, a=20.0)}
BREAKING_AWAY = {"breakaway": usual_values("breakaway", excess=5e5, v_s=0.1)}
HARD = {"hardening": usual_values("hardening")}
RUBBER = tuple(sorted(name for name in EFFECTS if EFFECTS[name].kind == "rubber"))
"""Every effect of the kind, new ones included."""


def halved(share: float) -> float:
    return share


def scaled_twice(u: float, stiffness: float, share: float) -> float:
    return stiffness * share * u


EXAMPLE = Effect(
    title="Example",
    law=halved,
    parameters=(Parameter("share", "1", (0.0, 1.0), LogNormal(0.5, 1.0), "that is left"),),
    absent={"share": 1.0},
    family="elasticity",
    explanation="",
    suspect_when="",
    source="",
)


def pushed(axial_load: float) -> Excitation:
    """Constant speed over 0.2 m, under a constant vertical load."""
    t = np.arange(0.0, 0.2 / SPEED, 1 / RATE)
    usual = Conditions.usual(t.size, RATE)
    return Excitation(RATE, SPEED * t, np.full(t.size, SPEED), replace(usual, axial_load=np.full(t.size, axial_load)))


@pytest.mark.parametrize(
    ("model", "exact"),
    [
        (BOUC_WEN, LAYER["bouc_wen"]["F_y"]),
        (SLIDING, 1e6 * (1 - 0.5 * np.exp(-20.0 * SPEED))),
        (BREAKING_AWAY, 5e5 * np.exp(-1.0)),
    ],
)
@pytest.mark.parametrize(("axial_load", "share", "factor"), [(1.3, 1.0, 1.3), (0.8, 0.5, 0.9), (0.5, 3.0, 0.0)])
def test_yield_and_friction_follow_the_vertical_load(
    model: dict[str, dict[str, float]], exact: float, axial_load: float, share: float, factor: float
) -> None:
    """Coulomb: friction is proportional to the load, so `share` is 1. No force pulls when the bearing lifts off."""
    force = layer_force({**model, "vertical_load": {"share": share}}, pushed(axial_load))
    assert force[-1] == pytest.approx(factor * exact, rel=1e-3, abs=1e-9 * exact)


@pytest.mark.parametrize("model", [BOUC_WEN, SLIDING, BREAKING_AWAY])
def test_yield_and_friction_grow_in_the_cold_and_rubber_does_not(model: dict[str, dict[str, float]]) -> None:
    """exp(0.007 · 30), 30 °C below the reference."""
    cold = pushed(1.0)
    cold = replace(cold, conditions=replace(cold.conditions, temperature=np.full(cold.velocity.size, -10.0)))
    temperature = {"temperature_strength": {"strengthening": 0.007, "reference": 20.0}}
    warm, growth = layer_force({**model, **HARD}, cold), layer_force({**model, **HARD, **temperature}, cold)
    alone = layer_force(model, cold)
    assert growth - warm == pytest.approx((np.exp(0.21) - 1) * alone, rel=1e-9, abs=1e-3)


@pytest.mark.accuracy
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", sorted(name for name in EFFECTS if EFFECTS[name].acts_on == "force"))
def test_a_scale_multiplies_the_forces_of_its_kinds_and_leaves_the_others(name: str, scale: str) -> None:
    """An effect that halves a scale halves the force at given states; only what shapes a yield may reach further."""
    if scale not in {one for scales in KINDS.values() for one in scales}:
        return
    halving = replace(EXAMPLE, law=halved, acts_on=scale)
    effects = {name: EFFECTS[name], "zz": halving}
    order, size, states = in_opcode_order(effects), len(EFFECTS[name].parameters), len(EFFECTS[name].states)
    p, x = np.array([*usual_values(name).values(), 0.5]), np.full(states, 0.3)
    places = {name: (0, 0), "zz": (size, states)}
    program = compiled_force(effects).py_func  # type: ignore[attr-defined]  # to compile each pair takes half a second

    def run(*names: str) -> float:
        opcode, at_p, at_x = (np.array(one) for one in zip(*((order.index(n), *places[n]) for n in names), strict=True))
        motion = (0.2, 0.3, 0.1, 0.2, 1.0, 20.0, 0.0, 0.5, 2.5e-3)
        return program(*motion, opcode, at_p, at_x, p, x, np.zeros(states))[0]

    factor = 0.5 if scale in KINDS.get(EFFECTS[name].kind or "", ()) else 1.0
    assert run("zz", name) == pytest.approx(factor * run(name), rel=1e-12)


@pytest.mark.parametrize(
    ("instead", "message"),
    [
        ({"kind": "liquid"}, "its kind 'liquid' must be one of rubber, yielding, sliding"),
        ({"kind": "rubber", "acts_on": "strength"}, "acts on 'strength'; only a force has a kind"),
        ({"kind": "rubber", "law": scaled_twice}, r"kind 'rubber' is multiplied by \['stiffness'\]; leave it"),
    ],
)
def test_a_kind_is_one_of_those_there_are_and_of_a_force(instead: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        replace(EXAMPLE, **instead)


@pytest.mark.parametrize("name", RUBBER)
def test_cold_rubber_is_stiffer_in_every_part_of_its_force(name: str) -> None:
    """exp(0.01 × 30) at 10 °C below zero, for a stiffness stated at 20 °C."""
    motion = equal_cycles(RATE, 2)
    cold = replace(motion, conditions=replace(motion.conditions, temperature=np.full(motion.velocity.size, -10.0)))
    model = {name: usual_values(name)}
    force = layer_force({**model, "temperature_stiffness": {"stiffening": 0.01, "reference": 20.0}}, cold)
    assert force == pytest.approx(np.exp(0.3) * layer_force(model, motion), rel=1e-9)


@pytest.mark.parametrize("name", RUBBER)
def test_a_step_scales_every_part_of_the_rubbers_force(name: str) -> None:
    """Nothing before the date, a share of 0.3 less after it; 25 widths away the step is complete to rounding."""
    motion = equal_cycles(RATE, 4)
    model, t = {name: usual_values(name)}, motion.conditions.time
    step = {"change": -0.3, "date": 2.0, "width": 0.02}
    ratio = 1.0 - 0.3 * (t > 2.0)
    away = np.abs(t - 2.0) > 0.5
    force, unchanged = layer_force({**model, "stiffness_step": step}, motion), layer_force(model, motion)
    assert force[away] == pytest.approx((ratio * unchanged)[away], rel=1e-9)


@pytest.mark.parametrize(("model", "exact"), [(BOUC_WEN, 0.7), (SLIDING, 0.7), (BREAKING_AWAY, 0.7), (HARD, 1.0)])
def test_a_step_of_the_yield_force_scales_what_yields_or_slides_and_no_rubber(
    model: dict[str, dict[str, float]], exact: float
) -> None:
    """Nothing before the date, a share of 0.3 less after it."""
    motion = equal_cycles(RATE, 4)
    t, step = motion.conditions.time, {"change": -0.3, "date": 2.0, "width": 0.02}
    force, unchanged = layer_force({**model, "strength_step": step}, motion), layer_force(model, motion)
    assert force[t < 1.5] == pytest.approx(unchanged[t < 1.5], rel=1e-9)
    assert force[t > 2.5] == pytest.approx(exact * unchanged[t > 2.5], rel=1e-9)


def test_neither_reaches_what_is_no_rubber() -> None:
    """Lead, friction, dampers and walls keep their forces: lead has a temperature effect of its own."""
    motion = equal_cycles(RATE, 2)
    cold = replace(motion, conditions=replace(motion.conditions, temperature=np.full(motion.velocity.size, -10.0)))
    model = {**BOUC_WEN, **SLIDING, "viscous": LAYER["viscous"], "moat": usual_values("moat")}
    scaled = {**model, "temperature_stiffness": usual_values("temperature_stiffness", stiffening=0.01)}
    assert layer_force(scaled, cold) == pytest.approx(layer_force(model, motion), rel=1e-12)


def test_softening_with_displacement_is_kondners_hyperbola() -> None:
    """k_s u / (1 + |u| / u_s): half of the stiffness at u_s, and never more force than k_s u_s."""
    u = np.array([-0.5, -0.02, 0.0, 0.02, 0.1, 50.0])
    still = Excitation(RATE, u, np.zeros(u.size), Conditions.usual(u.size, RATE))
    force = layer_force({"strain_softening": usual_values("strain_softening", k_s=1e8, u_s=0.02)}, still)
    assert force == pytest.approx(1e8 * u / (1 + np.abs(u) / 0.02), rel=1e-12)
    assert force[3] == pytest.approx(1e6)
    assert force[-1] == pytest.approx(1e8 * 0.02, rel=1e-3)
