"""Dampers in series with their brace, against closed forms, their limits and an implicit solver."""

from math import gamma

import numpy as np
import pytest
from excitations import LAYER, TURN, equal_cycles, excitation, layer_force, swelling_motion, usual_values
from scipy.integrate import solve_ivp

from core import paper
from core.arrays import Vector
from core.model.force_response import ForceResponse, force_response
from core.model.isolator import Isolator
from core.model.simulation import simulate

RATE, SECONDS, AMPLITUDE = 100.0, 8.0, 0.25


def braced_viscous(**instead: float) -> dict[str, dict[str, float]]:
    return {"braced_viscous": usual_values("braced_viscous", **instead)}


def braced_relief(**instead: float) -> dict[str, dict[str, float]]:
    return {"braced_relief": usual_values("braced_relief", **instead)}


def held(model: dict[str, dict[str, float]], spring: float, seconds: float) -> Vector:
    """(n,) N, while the layer stands still, from a spring that is loaded."""
    still = np.zeros(round(seconds * RATE))
    return force_response(Isolator(model), still, still, RATE, states=np.array([spring])).force


def relative(result: Vector, exact: Vector) -> float:
    return float(np.linalg.norm(result - exact) / np.linalg.norm(exact))


@pytest.mark.parametrize("exponent", [0.3, 0.5, 2.0])
def test_a_held_power_law_damper_relaxes_as_a_power_of_time(exponent: float) -> None:
    """q' = -(v₀/δ) q^m with m = 1/α: q^(1-m) = q₀^(1-m) + (m - 1) (v₀/δ) t; to nothing in finite time for m < 1."""
    force, speed, give, t = 1e6, 0.1, 0.05, np.arange(300) / RATE
    m, spring = 1 / exponent, 1.5
    exact = np.maximum(spring ** (1 - m) + (m - 1) * speed / give * t, 0.0) ** (1 / (1 - m))
    result = held(braced_viscous(force=force, exponent=exponent, speed=speed, give=give), spring, 3.0)
    assert result == pytest.approx(force * exact, abs=1e-4 * force)


def test_a_held_oil_damper_relaxes_fast_until_its_valve_closes() -> None:
    """x = w - v_r: x + p v_r decays by exp(-t / (p τ)) until x = 0, from then on w by exp(-t / τ)."""
    v_r, left, tau, w, t = 0.1, 0.2, 0.5, 0.25, np.arange(200) / RATE
    closes = left * tau * np.log((w - v_r + left * v_r) / (left * v_r))
    open_ = v_r + (w - v_r + left * v_r) * np.exp(-t / (left * tau)) - left * v_r
    exact = np.where(t < closes, open_, v_r * np.exp(-(t - closes) / tau))
    result = held(braced_relief(coefficient=1e6, v_r=v_r, left=left, tau=tau), w, 2.0)
    assert result == pytest.approx(1e6 * exact, abs=2e-4 * 1e6 * w)


@pytest.mark.parametrize("rate", [50.0, 100.0, 800.0])
@pytest.mark.parametrize("exponent", [0.3, 0.5, 1.0, 1.8])
def test_a_rigid_brace_leaves_the_damper(exponent: float, rate: float) -> None:
    """A give of 0.1 µm; 1e-3: where an exponent is small, the spring takes part at each reversal."""
    given = excitation(rate, SECONDS, AMPLITUDE)
    values = {"force": 1e6, "exponent": exponent, "speed": 0.1}
    exact = layer_force({"power_viscous": {**values, "linear": 1e-6}}, given)
    assert relative(layer_force(braced_viscous(**values, give=1e-7), given), exact) < 1e-3


@pytest.mark.parametrize("rate", [50.0, 100.0, 800.0])
def test_a_rigid_brace_leaves_the_oil_damper(rate: float) -> None:
    """But for ω τ, with the 1 µs that it still takes."""
    given = excitation(rate, SECONDS, AMPLITUDE)
    exact = layer_force({"viscous": {"c_b": 5e6}, "relief": {"relieved": 4.5e6, "v_r": 0.1}}, given)
    result = layer_force(braced_relief(coefficient=5e6, v_r=0.1, left=0.1, tau=1e-6), given)
    assert relative(result, exact) < 2e-5


def test_linear_dampers_are_maxwells_element() -> None:
    given = excitation(RATE, SECONDS, AMPLITUDE)
    exact = layer_force({"maxwell": {"K": 1e8, "tau": 0.1}}, given)
    power = braced_viscous(force=1e6, speed=0.1, exponent=1.0, give=1e-2)
    for model in (
        power,
        braced_relief(coefficient=1e7, tau=0.1, left=1.0),
        braced_relief(coefficient=1e7, tau=0.1, v_r=5.0),
    ):
        assert layer_force(model, given) == pytest.approx(exact, abs=1e-9 * abs(exact).max())


def test_below_its_force_a_damper_that_hardly_slips_leaves_its_brace() -> None:
    """F u / δ: at half its force a damper with an exponent of 0.1 moves at 2^-10 of its reference speed, 0.1 mm/s."""
    given = equal_cycles(400.0, count=1, amplitude=0.25)
    result = layer_force(braced_viscous(force=1e6, speed=0.1, exponent=0.1, give=0.5), given)
    assert relative(result, 1e6 / 0.5 * given.displacement) < 1e-3


@pytest.mark.parametrize("exponent", [0.3, 0.7, 1.5])
def test_energy_per_cycle_is_that_of_the_published_form(exponent: float) -> None:
    """W = 4 · 2^α Γ²(1 + α/2) / Γ(2 + α) C ω^α X^(1+α) (Soong and Constantinou, 1994), for a brace that is rigid."""
    given, X = equal_cycles(400.0, count=3, amplitude=0.2), 0.2
    force = layer_force(braced_viscous(force=1e6, speed=0.1, exponent=exponent, give=1e-7), given)
    cycle = slice(-given.velocity.size // 3, None)
    work = float(np.sum((force * given.velocity)[cycle])) / 400.0
    shape = 4 * 2**exponent * gamma(1 + exponent / 2) ** 2 / gamma(2 + exponent)
    assert work == pytest.approx(shape * 1e6 / 0.1**exponent * TURN**exponent * X ** (1 + exponent), rel=5e-3)


def exact(slips: object, tau: float, times: Vector) -> Vector:
    """(n,) force over the damper's scale, by an implicit solver that needs no limit of the spring's speed."""

    def rate(t: float, q: Vector) -> list[float]:
        return [(swelling_motion(t, SECONDS, AMPLITUDE)[1] - slips(q[0])) / tau]  # type: ignore[operator]

    solved = solve_ivp(rate, (0.0, times[-1]), [0.0], "Radau", t_eval=times, rtol=1e-7, atol=1e-10, max_step=5e-3)
    return np.asarray(solved.y[0])


@pytest.mark.accuracy
@pytest.mark.parametrize("give", [1e-5, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize(("exponent", "tolerance"), [(0.3, 8e-3), (0.7, 1e-3), (1.5, 1e-3), (2.0, 1e-3)])
def test_any_brace_is_followed_at_coarse_and_fine_steps(exponent: float, tolerance: float, give: float) -> None:
    """The worst, 7.5e-3, is a small exponent, whose force turns within the time that a step takes."""
    times = excitation(50.0, SECONDS).conditions.time
    truth = exact(lambda q: 0.1 * np.sign(q) * abs(q) ** (1 / exponent), give, times)
    model = braced_viscous(force=1.0, speed=0.1, exponent=exponent, give=give)
    for rate in (50.0, 100.0, 400.0):
        result = layer_force(model, excitation(rate, SECONDS, AMPLITUDE))[:: round(rate / 50)]
        assert relative(result, truth) < tolerance


@pytest.mark.parametrize("give", [1e-3, 2e-2, 0.1])
@pytest.mark.parametrize("exponent", [1.5, 2.0, 2.9])
def test_derivatives_stay_bounded_where_a_damper_of_a_large_exponent_stands_still(exponent: float, give: float) -> None:
    """Its speed is a root of its force, whose slope at zero is infinite: against differences, over many reversals."""
    given = excitation(RATE, 4 * SECONDS, AMPLITUDE)
    wanted, near = ("exponent", "give"), {"exponent": exponent, "give": give}

    def response(wanted: tuple[str, ...] = (), **values: float) -> ForceResponse:
        model = Isolator(braced_viscous(force=1.0, speed=0.1, **{**near, **values}))
        keys = tuple(("braced_viscous", name) for name in wanted)
        return force_response(model, given.displacement, given.velocity, RATE, wanted=keys)

    for name, derivative in zip(wanted, response(wanted).by_parameter, strict=True):
        either = (response(**{name: near[name] * (1 + change)}).force for change in (1e-3, -1e-3))
        assert relative(derivative * 2e-3 * near[name], np.subtract(*either)) < 0.2


@pytest.mark.parametrize("tau", [1e-4, 1e-3, 1e-2, 0.1])
def test_any_oil_damper_is_followed_at_coarse_and_fine_steps(tau: float) -> None:
    times = excitation(50.0, SECONDS).conditions.time
    truth = exact(lambda w: w + np.sign(w) * max(abs(w) - 0.1, 0.0) * 9.0, tau, times)
    model = braced_relief(coefficient=1.0, v_r=0.1, left=0.1, tau=tau)
    for rate in (50.0, 100.0, 400.0):
        result = layer_force(model, excitation(rate, SECONDS, AMPLITUDE))[:: round(rate / 50)]
        assert relative(result, truth) < 3e-3


@pytest.mark.parametrize(
    "damper",
    [
        braced_viscous(force=2e6, exponent=0.3, give=1e-7),
        braced_viscous(force=2e6, exponent=0.3, give=1e-3),
        braced_relief(coefficient=1e7, tau=1e-6, v_r=0.02),
        braced_relief(coefficient=1e7, tau=1e-2, v_r=0.02),
    ],
)
def test_a_building_on_braced_dampers_is_simulated_at_usual_steps(damper: dict[str, dict[str, float]]) -> None:
    """The usual steps against twenty times as many."""
    t = np.arange(0.0, 10.0, 1 / RATE)
    ground = 2.0 * np.sin(2 * np.pi * 0.7 * t) * np.sin(np.pi * t / 10.0)
    layer = Isolator({**LAYER, **damper})
    usual, fine = (simulate(paper.BUILDING, layer, ground, RATE, substeps=n) for n in (None, 60))
    assert relative(usual.force, fine.force) < 2e-3
    assert relative(usual.isolator_displacement, fine.isolator_displacement) < 2e-3
