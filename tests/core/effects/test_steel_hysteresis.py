"""Steel against Menegotto and Pinto's curves (1973), with the roundness of Filippou, Popov and Bertero (1983)."""

import numpy as np
import pytest
from excitations import Excitation, excitation, layer_force

from core.arrays import Vector
from core.model.isolator import Conditions

D, R_0 = 0.01, 20.0
FINE = 16
"""Steps of the exact curves in one of the records' intervals."""


def curve(travel: Vector, start: float, sign: float, excursion: float) -> Vector:
    """Force over the yield force after a travel in yield displacements from a reversal at `start`: their eqs 1 to 5."""
    roundness = R_0 * (1 - 18.5 / 20 * excursion / (0.15 + excursion))
    share = travel / (1 - sign * start)
    return start + (sign - start) * share / (1 + share**roundness) ** (1 / roundness)


def test_the_curves_between_three_reversals_are_the_published_ones() -> None:
    """From rest to 4 D, to -3 D and to 2 D, at 0.1 m/s. A velocity that jumps within 2.5 ms costs 4e-3."""
    rate, speed = 400.0, 0.1
    ends = np.array([0.0, 4.0, -3.0, 2.0]) * D
    count = np.round(np.abs(np.diff(ends)) / speed * rate).astype(int)
    rows = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(ends[:-1], ends[1:], count, strict=True)]
    u = np.concatenate(rows)
    v = np.repeat(speed * np.sign(np.diff(ends)), count)
    given = Excitation(rate, u, v, Conditions.usual(u.size, rate))
    force = layer_force({"steel_hysteresis": {"F_m": 1.0, "D_m": D, "R_0": R_0}}, given)
    out = curve(rows[0] / D, 0.0, 1.0, 0.0)
    top = float(curve(np.array([4.0]), 0.0, 1.0, 0.0)[0])
    # how far the yield that a curve leads to lies within the extreme that was reached on that side, or the first yield
    back = curve((4 * D - rows[1]) / D, top, -1.0, abs(-1 - (4 - 1 - top)))
    low = float(curve(np.array([7.0]), top, -1.0, abs(-1 - (4 - 1 - top)))[0])
    forth = curve((rows[2] + 3 * D) / D, low, 1.0, abs(4 - (-3 + 1 - low)))
    apart = np.abs(force - np.concatenate([out, back, forth]))
    settled = np.ones(u.size, dtype=bool)
    for turn in np.cumsum(count)[:-1]:  # the velocity jumps there, over two samples
        settled[turn - 1 : turn + 3] = False
    assert apart[settled].max() < 1e-2
    assert np.sqrt(np.mean(apart[settled] ** 2)) < 5e-3


def test_in_any_motion_the_force_follows_the_published_rules() -> None:
    """Exact curves from reversal to reversal; rms over the yield force."""
    fine, given = excitation(100.0 * FINE, 5.0, 0.05), excitation(100.0, 5.0, 0.05)
    force = layer_force({"steel_hysteresis": {"F_m": 1.0, "D_m": D, "R_0": R_0}}, given)
    exact = by_rules(fine.displacement / D)[::FINE]
    assert np.abs(exact).max() > 0.98
    assert np.sqrt(np.mean((force - exact)[:-1] ** 2)) < 1e-3


def by_rules(u: Vector) -> Vector:
    """Force over the yield force under displacements over the yield displacement."""
    force, sign, turn, start, excursion = np.zeros(u.size), 0.0, 0.0, 0.0, 0.0
    extremes = {1.0: 1.0, -1.0: -1.0}
    for now in range(1, u.size):
        way = float(np.sign(u[now] - u[now - 1]))
        if way not in (sign, 0.0):
            if sign:
                extremes[sign] = sign * max(sign * extremes[sign], sign * u[now - 1])
            sign, turn, start = way, float(u[now - 1]), float(force[now - 1])
            excursion = abs(extremes[sign] - (turn + sign - start))
        force[now] = curve(np.abs(u[now : now + 1] - turn), start, sign, excursion)[0] if sign else 0.0
    return force


@pytest.mark.parametrize("R_0", [10.0, 60.0])
def test_below_its_yield_steel_is_a_spring(R_0: float) -> None:
    """A small motion stays on the elastic line, for the roundness takes away x^R / R of it."""
    given = excitation(100.0, 5.0, 0.1 * D)
    force = layer_force({"steel_hysteresis": {"F_m": 1.0, "D_m": D, "R_0": R_0}}, given)
    assert force == pytest.approx(given.displacement / D, abs=1e-5)
