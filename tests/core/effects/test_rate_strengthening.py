"""Strength that grows with the speed: Robinson's (1982) lead, at constant speeds and in harmonic cycles."""

import numpy as np
import pytest
from excitations import LAYER, TURN, Excitation, equal_cycles, layer_force
from scipy import integrate

from core.arrays import Vector
from core.effects.rate_strengthening import USUAL
from core.model.isolator import Conditions

YIELD = {"bouc_wen": {**LAYER["bouc_wen"], "F_y": 1.0}}
FAST, SLOW = 0.035, 0.15
"""Powers of the shear rate that Robinson (1982) found for lead, in fast and in slow motion."""


def pushed(speed: float, power: float, slow: float, rate: float = 200.0) -> Vector:
    """Force over the yield force, at a constant speed over 0.2 m."""
    t = np.arange(0.0, 0.2 / speed, 1 / rate)
    given = Excitation(rate, speed * t, np.full(t.size, speed), Conditions.usual(t.size, rate))
    return layer_force({**YIELD, "rate_strengthening": {"power": power, "slow": slow}}, given)


@pytest.mark.parametrize("power", [FAST, SLOW])
def test_ten_times_the_speed_raises_the_strength_as_that_of_lead(power: float) -> None:
    """Once yielded: 8.4 % in fast motion, 41 % in slow motion, far above the speed below which it is constant."""
    slower, faster = (pushed(speed, power, slow=1e-4)[-1] for speed in (0.05, 0.5))
    assert faster / slower == pytest.approx(10.0**power, rel=1e-5)


def test_at_the_usual_speed_the_strength_is_the_dampers_own_and_below_the_slow_one_it_is_constant() -> None:
    assert pushed(USUAL, SLOW, slow=0.01)[-1] == pytest.approx(1.0, rel=1e-6)
    creeping, crawling = (pushed(speed, SLOW, slow=0.5, rate=20.0)[-1] for speed in (0.002, 0.01))
    assert crawling == pytest.approx(creeping, rel=1e-4)


def test_the_work_in_a_cycle_is_that_of_the_law() -> None:
    """∮ F du of a damper that yields after 0.1 mm: z is the sign of the speed but for a thousandth of the way."""
    sharp = {"bouc_wen": {**YIELD["bouc_wen"], "D_y": 1e-4}}
    given = equal_cycles(1000.0, count=2, amplitude=0.1)
    values = {"power": 0.2, "slow": 0.02}
    force = layer_force({**sharp, "rate_strengthening": values}, given)
    half = force.size // 2
    work = np.sum((force * given.velocity)[half:]) / given.rate
    largest = 0.1 * TURN

    def power(phase: float) -> float:
        speed = largest * np.sin(phase)
        return ((values["slow"] ** 2 + speed**2) / (values["slow"] ** 2 + USUAL**2)) ** 0.1 * np.sin(phase)

    expected, _ = integrate.quad(power, 0.0, np.pi)
    assert work == pytest.approx(2.0 * 0.1 * expected, rel=5e-3)
