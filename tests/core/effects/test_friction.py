"""Friction against the rigid slider it becomes, and what a step can follow."""

from collections.abc import Callable

import numpy as np
import pytest
from excitations import Excitation, equal_cycles, layer_force, usual_values

from core.arrays import Vector
from core.effects.friction import SHORTEST


def test_a_loop_of_short_slip_has_the_area_of_a_rigid_slider() -> None:
    """4 F a (Coulomb). The slip rounds each of two reversals off: some slips of the 4 a = 800 slips round the loop."""
    given = equal_cycles(400.0, count=4, amplitude=0.1)
    force = layer_force({"friction": usual_values("friction", sliding=2e6, share=1e-3, slip=5e-4)}, given)
    last = -given.velocity.size // 4
    area = np.sum((force * given.velocity)[last:]) / given.rate
    assert area == pytest.approx(4 * 2e6 * 0.1, rel=1e-2)


def test_sliding_fast_needs_more_force_than_sliding_slowly() -> None:
    """Constantinou et al. (1990): the slow share is missing at rest and back, but for exp(-a v), at speed."""
    rate, values = 400.0, usual_values("friction", sliding=1e6, share=0.5, a=20.0)
    for speed in (0.01, 0.05, 0.5):
        t = np.arange(0, 0.1 / speed, 1 / rate)
        still = equal_cycles(rate, 1)
        given = Excitation(rate, speed * t, np.full(t.size, speed), still.conditions.usual(t.size, rate))
        assert layer_force({"friction": values}, given)[-1] == pytest.approx(
            1e6 * (1 - 0.5 * np.exp(-20 * speed)), rel=1e-3
        )


def test_the_shortest_slip_in_the_fastest_motion_stays_bounded() -> None:
    """At the coarsest step, 5 ms, of an ordinary record at 50 Hz; an eighth above: what a step overshoots."""
    given = equal_cycles(50.0, count=3, amplitude=0.5)
    for corner in (2.0, 100.0):
        values = usual_values("friction", sliding=1.0, slip=5e-5, corner=corner)
        assert 0.8 < abs(layer_force({"friction": values}, given)).max() < 1.125
    assert SHORTEST > 0.005 / 2.785  # RK4's bound on the real axis


def wen(given: Excitation, share: float, a: float, slip: float) -> Vector:
    """Constantinou et al. (1990) over the sliding force: Wen's variable (n = 2, β = γ) exact over each step."""
    z = np.zeros(given.velocity.size)
    for now, travel in enumerate(np.diff(given.displacement), 1):
        sign, left = (1.0 if travel >= 0 else -1.0), abs(travel) / slip
        along = z[now - 1] * sign
        if along < 0:
            along, left = min(along + left, 0.0), max(left + along, 0.0)
        grown = np.tanh(left)
        z[now] = sign * (along + grown) / (1 + along * grown)
    return np.asarray((1 - share * np.exp(-a * abs(given.velocity))) * z)


def returned(given: Excitation, share: float, a: float, slip: float) -> Vector:
    """A spring whose force returns to the strength at the speed: Simo & Hughes (1998), over the sliding force."""
    force = np.zeros(given.velocity.size)
    strength = 1 - share * np.exp(-a * abs(given.velocity))
    for now, travel in enumerate(np.diff(given.displacement), 1):
        force[now] = np.clip(force[now - 1] + travel / slip, -strength[now], strength[now])
    return force


@pytest.mark.parametrize(("corner", "exact"), [(2.0, wen), (100.0, returned)])
def test_the_law_goes_from_round_to_sharp(corner: float, exact: Callable[..., Vector]) -> None:
    """1.5 %, root mean square over the force: by the bound on the rate near sliding."""
    values = {"share": 0.5, "a": 20.0, "slip": 1e-3}
    fine, given = equal_cycles(8000.0, count=3, amplitude=0.03), equal_cycles(200.0, count=3, amplitude=0.03)
    force = layer_force({"friction": {"sliding": 1.0, **values, "corner": corner}}, given)
    wanted = exact(fine, **values)[::40][: force.size]
    assert np.linalg.norm(force - wanted) < 0.015 * np.linalg.norm(wanted)
