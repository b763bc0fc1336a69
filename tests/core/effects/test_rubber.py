"""Effects of high-damping rubber, against exact solutions of their laws."""

import numpy as np
import pytest
from excitations import Excitation, equal_cycles, excitation, layer_force, usual_values

from core.arrays import Vector
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator, carried

RATE = 200.0
ELASTIC = {"elastic": {"k_b": 1e8}}
SPECTRUM = {"F_s": 1e6, "s": 0.6, "D": 1e-3}
REACHES = 1e-3 * 100 ** (np.arange(4) / 3)
"""m, over which its elements develop."""
WEIGHTS = (REACHES / 0.03) ** 0.4
RUBBER = {"second_hysteresis": {"F_2": 1e6, "D_2": 0.02}}


def ramp(speed: float, seconds: float, hold: float = 0.0) -> Excitation:
    """Constant speed from rest, and a rest where it ends."""
    moving = np.arange(round(seconds * RATE)) / RATE
    still = np.zeros(round(hold * RATE))
    u = np.concatenate([speed * moving, speed * seconds + still])
    return Excitation(RATE, u, np.concatenate([np.full(moving.size, speed), still]), Conditions.usual(u.size, RATE))


def exactly_stepped(displacement: Vector, bound: Vector | float = 1.0) -> Vector:
    """(n,) N: the spectrum by exact steps of the displacement, z ← S + (z − S) exp(−|Δu| / D)."""
    z, force = np.zeros(4), [0.0]
    for change in np.diff(displacement):
        end = np.sign(change) * bound
        z = end + (z - end) * np.exp(-abs(change) / REACHES)
        force.append(1e6 * float(WEIGHTS @ z))
    return np.array(force)


def test_the_elements_of_the_spectrum_develop_exponentially() -> None:
    """Over one straight way, 1 − exp(−u / D) each; 1e-3: the first millimetre at 100 mm/s has two samples."""
    given = ramp(0.1, 1.5)
    exact = 1e6 * (1 - np.exp(-given.displacement[:, None] / REACHES)) @ WEIGHTS
    assert layer_force({"hysteresis_spectrum": SPECTRUM}, given)[:-1] == pytest.approx(
        exact[:-1], abs=1e-3 * exact.max()
    )


@pytest.mark.parametrize(("rate", "most"), [(100.0, 6e-3), (200.0, 2e-3)])
def test_the_stiff_elements_follow_exact_steps_of_the_displacement(rate: float, most: float) -> None:
    """Up to 1.1 m/s, at which the first element's rate is 1100 per second; largest error over the largest force."""
    fine = excitation(16 * rate, 8.0)
    exact = exactly_stepped(fine.displacement)[::16]
    force = layer_force({"hysteresis_spectrum": SPECTRUM}, excitation(rate, 8.0))
    assert abs(force - exact)[:-1].max() < most * abs(exact).max()


@pytest.mark.parametrize(("name", "power"), [("recent_softening", "a"), ("lasting_softening", "b")])
def test_softening_is_a_power_of_the_largest_displacement(name: str, power: str) -> None:
    """Force by the running maximum; 1 % of the largest force: within a step or two of its passing."""
    given = excitation(RATE, seconds=20.0, amplitude=0.15)
    force = layer_force({**ELASTIC, name: {power: 0.3, "u_r": 4e-3, "u_0": 0.1}}, given)
    largest = np.maximum.accumulate(abs(given.displacement))
    exact = 1e8 * given.displacement * ((largest + 4e-3) / 0.104) ** -0.3
    assert force == pytest.approx(exact, abs=1e-2 * abs(exact).max())


def test_one_memory_ends_with_the_earthquake_and_the_other_does_not() -> None:
    """A small motion after a strong earthquake: as at its beginning, and as soft as the strongest motion left it."""
    strong, small = equal_cycles(RATE, 2, amplitude=0.2), equal_cycles(RATE, 1, amplitude=0.01)
    again, quarter = {}, slice(2, small.velocity.size // 4)
    for name in ("recent_softening", "lasting_softening"):
        model = Isolator({**ELASTIC, name: usual_values(name)})
        after = force_response(model, strong.displacement, strong.velocity, RATE)
        states = carried(model, after.states)
        new, later = (
            force_response(model, small.displacement, small.velocity, RATE, states=one).force[quarter]
            for one in (None, states)
        )
        again[name] = later / new
    assert again["recent_softening"] == pytest.approx(1.0)
    reached = small.displacement[quarter] + 4e-3
    assert again["lasting_softening"] == pytest.approx((0.204 / reached) ** -0.12, rel=1e-2)


def test_softened_rubber_recovers_while_it_rests_at_less_than_it_has_reached() -> None:
    """Out to 100 mm, back to 20 mm and a rest: the recent displacement fades as exp(−t / t_f) until it is 20 mm."""
    t, still = np.arange(0.0, 1.0, 1 / RATE), np.arange(0.0, 10.0, 1 / RATE)
    u = np.concatenate([0.05 * (1 - np.cos(np.pi * t)), 0.06 + 0.04 * np.cos(np.pi * t), np.full(still.size, 0.02)])
    v = np.gradient(u, 1 / RATE)
    given = Excitation(RATE, u, v, Conditions.usual(u.size, RATE))
    force = layer_force({**ELASTIC, "softening_recovery": {"d": 0.2, "t_f": 3.0, "u_r": 4e-3}}, given)
    begun = np.flatnonzero(u > 0.0999)[-1] / RATE
    since = np.arange(u.size) / RATE - begun
    recent = np.maximum(0.1 * np.exp(-since / 3.0), 0.02)
    exact = 1e8 * 0.02 * (0.104 / (recent + 4e-3)) ** 0.2
    assert force[2 * t.size :] == pytest.approx(exact[2 * t.size :], rel=1e-2)


def test_the_loop_has_the_same_shape_at_every_size() -> None:
    """k_2 x + k_3 x² of the share x of the running maximum; 1 % of the largest force, as above."""
    given = excitation(RATE, seconds=20.0, amplitude=0.15)
    force = layer_force({"loop_shape": {"k_2": -3e7, "k_3": 5e7}}, given)
    u, largest = given.displacement, np.maximum.accumulate(abs(given.displacement))
    share = abs(u) / np.maximum(largest, 1e-6)
    exact = (-3e7 * share + 5e7 * share**2) * u
    assert force == pytest.approx(exact, abs=1e-2 * abs(exact).max())


def test_strength_grows_with_the_square_of_the_displacement() -> None:
    """On a straight way, D dz/du = 1 + (u / u_H)² − z, which a polynomial and an exponential solve."""
    given, D = ramp(0.1, 2.0), 0.02
    u = given.displacement
    z = 1 + (u**2 - 2 * D * u + 2 * D**2) / 0.2**2 - (1 + 2 * D**2 / 0.2**2) * np.exp(-u / D)
    force = layer_force({**RUBBER, "strength_growth": {"u_H": 0.2}}, given)
    assert force[:-1] == pytest.approx(1e6 * z[:-1], abs=1e3)


@pytest.mark.parametrize("hysteresis", [RUBBER, {"hysteresis_spectrum": SPECTRUM}])
def test_hysteretic_force_relaxes_at_rest(hysteresis: dict[str, dict[str, float]]) -> None:
    """By exp(−r t) in rest, whatever the elements."""
    given = ramp(0.1, 1.0, hold=3.0)
    force = layer_force({**hysteresis, "stress_relaxation": {"rate": 0.8}}, given)[round(1.1 * RATE) :]
    assert force == pytest.approx(force[0] * np.exp(-0.8 * np.arange(force.size) / RATE), rel=1e-5)
