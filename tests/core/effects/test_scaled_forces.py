"""Vertical load, temperature and a step scale the forces that they act on, against exact values."""

from dataclasses import replace

import numpy as np
import pytest
from excitations import LAYER, Excitation, equal_cycles, layer_force, usual_values

from core.model.isolator import Conditions

RATE = 400.0
SPEED = 0.1
"""m/s."""
BOUC_WEN = {"bouc_wen": LAYER["bouc_wen"]}
SLIDING = {"friction": usual_values("friction", sliding=1e6, share=0.5, a=20.0)}
BREAKING_AWAY = {"breakaway": usual_values("breakaway", excess=5e5, v_s=0.1)}
RUBBER = ("elastic", "hardening", "asymmetry", "mullins", "strain_softening", "second_hysteresis")


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
