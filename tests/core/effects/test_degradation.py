"""Yields that lose strength, stiffness or both with the energy they dissipate, and pinch: Baber and Wen, and Noori."""

from collections.abc import Mapping

import numpy as np
import pytest
from excitations import LAYER, Excitation, equal_cycles, excitation, layer_force, swelling_motion, usual_values
from scipy.integrate import solve_ivp

from core.arrays import Vector
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator, state_names

YIELD: Mapping[str, Mapping[str, float]] = {"bouc_wen": {**LAYER["bouc_wen"], "F_y": 1.0, "D_y": 2e-3}}
RATE, SPEED = 400.0, 0.1


def pushed(travel: float) -> Excitation:
    """One way, at a constant speed."""
    t = np.arange(0.0, travel / SPEED, 1 / RATE)
    return Excitation(RATE, SPEED * t, np.full(t.size, SPEED), Conditions.usual(t.size, RATE))


def test_a_yield_force_falls_with_the_root_of_the_travel() -> None:
    """z = 1/ν and ε' = z v: ν² = 1 + 2 δ s, in steady yielding. 2 %: the travel before it yields."""
    given, delta = pushed(2.0), 3.0
    force = layer_force({**YIELD, "strength_degradation": {"delta_nu": delta}}, given)
    late = given.displacement > 0.2
    assert force[late] == pytest.approx(1 / np.sqrt(1 + 2 * delta * given.displacement[late]), rel=2e-2)


def test_a_yield_that_loses_stiffness_keeps_its_force() -> None:
    """The force reaches F_y, over η times the yield displacement: 1 - z = exp(-s / (η D_y)) from z = 0."""
    given, eta = pushed(0.3), 1 + 5.0 * 2.0
    worn = {**YIELD, "stiffness_degradation": {"delta_eta": 5.0}}
    assert layer_force(worn, given)[-1] == pytest.approx(1.0, abs=1e-3)
    t = np.arange(0.0, 0.05 / SPEED, 1 / RATE)
    again = Excitation(RATE, SPEED * t, np.full(t.size, SPEED), Conditions.usual(t.size, RATE))
    model = {"bouc_wen": {**YIELD["bouc_wen"], "beta": 0.5, "gamma": 0.5}, "stiffness_degradation": {"delta_eta": 5.0}}
    states = {"energy": 2.0, "z": 0.0}
    result = from_states(model, states, again)
    assert result == pytest.approx(1 - np.exp(-again.displacement / (eta * 2e-3)), abs=2e-2)


def from_states(model: Mapping[str, Mapping[str, float]], states: Mapping[str, float], given: Excitation) -> Vector:
    """(n,) N, of a layer that begins with these states."""
    layer = Isolator(model)
    start = np.array([states[state] for _, state in state_names(layer)])
    return force_response(layer, given.displacement, given.velocity, given.rate, states=start).force


@pytest.mark.parametrize("name", ["degradation", "strength_degradation", "stiffness_degradation"])
def test_the_three_are_the_two_parameters_of_baber_and_wen(name: str) -> None:
    """z' = (A v - ν (...)) / η by a general solver: ν = η for the first, one of them 1 for the others."""
    delta, D_y, beta, gamma = 2.0, 5e-3, 0.6, 0.4
    nu, eta = (name != "stiffness_degradation") * delta, (name != "strength_degradation") * delta

    def rate(t: float, x: Vector) -> list[float]:
        v, z, energy = swelling_motion(t, 5.0, 0.25)[1], x[0], max(x[1], 0.0)
        plastic = gamma * abs(v) * z + beta * v * abs(z)
        return [(v - (1 + nu * energy) * plastic) / (1 + eta * energy) / D_y, x[0] * v]

    given = excitation(RATE, 5.0, 0.25)
    times = given.conditions.time
    truth = solve_ivp(rate, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-10, max_step=2e-3).y[0]
    layer = {"bouc_wen": {**YIELD["bouc_wen"], "D_y": D_y, "beta": beta, "gamma": gamma}}
    (parameter,) = usual_values(name)
    force = layer_force({**layer, name: {parameter: delta}}, given)
    assert np.linalg.norm(force - truth) < 2e-3 * np.linalg.norm(truth)


def test_degrading_and_pinching_together() -> None:
    """Baber and Noori (1986): h(z) [A v - ν (...)] / η, both after the same energy, by a general solver."""
    delta, D_y, z1, z2, q, wear = 1.0, 5e-3, 0.8, 0.3, 0.1, 0.5

    def rate(t: float, x: Vector) -> list[float]:
        v, z, energy = swelling_motion(t, 5.0, 0.25)[1], x[0], max(x[1], 0.0)
        plastic, worn = 0.5 * (abs(v) * z + v * abs(z)), 1 + delta * energy
        severity = z1 * (1 - np.exp(-energy / wear))
        opened = 1 - severity * np.exp(-(((z * np.sign(v) - q) / z2) ** 2))
        return [opened * (v - worn * plastic) / worn / D_y, z * v]

    given = excitation(RATE, 5.0, 0.25)
    times = given.conditions.time
    truth = solve_ivp(rate, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-10, max_step=2e-3).y[0]
    layer = {"bouc_wen": {**YIELD["bouc_wen"], "D_y": D_y, "beta": 0.5, "gamma": 0.5}}
    pinched = {"growing_pinching": {"z1": z1, "z2": z2, "q": q, "wear": wear}, "degradation": {"delta": delta}}
    force = layer_force({**layer, **pinched}, given)
    assert np.linalg.norm(force - truth) < 3e-3 * np.linalg.norm(truth)


def test_pinching_that_grows_at_once_or_never() -> None:
    given = equal_cycles(RATE, count=3, amplitude=0.1)
    shape = {"z1": 0.8, "z2": 0.3, "q": 0.1}
    pinched, plain = layer_force({**YIELD, "pinching": shape}, given), layer_force(YIELD, given)
    never, at_once = (layer_force({**YIELD, "growing_pinching": shape | {"wear": wear}}, given) for wear in (1e3, 1e-3))
    later = slice(given.velocity.size // 3, None)
    assert np.linalg.norm((at_once - pinched)[later]) < 1e-3 * np.linalg.norm(pinched)
    assert np.linalg.norm(never - plain) < 1e-2 * np.linalg.norm(pinched - plain)
