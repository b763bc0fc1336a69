"""Share of the excess error that an effect takes, and the share from which on it has a name."""

import numpy as np
import pytest
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.worth import EARNS, EARNS_HELD_OUT, Judge, NoiseRatios, Worth, excess, worth
from core.fitting.data import FitData
from core.fitting.fit import at_values, rms_by_record
from core.fitting.noise import noise_rms
from core.model.isolator import Isolator

SOFT = Isolator({**BOUC_WEN.effects, "elastic": {"k_b": 400e6}})


def test_the_excess_is_power_beyond_the_noise() -> None:
    assert excess(3.0) == pytest.approx(8.0)
    assert excess(0.9) == 0.0
    assert excess(1.5, floor=0.5) == pytest.approx(2.0)


def test_an_effect_takes_what_the_excess_falls_by() -> None:
    taken = worth(NoiseRatios(3.0, 5.0), NoiseRatios(2.0, 1.0))
    assert taken == Worth(pytest.approx(5 / 8), pytest.approx(1.0))


def test_an_effect_that_moves_a_large_error_by_a_hair_has_no_name_however_certain_it_is() -> None:
    """19.8 % to 19.7 % of the force, at a noise of 1 %."""
    taken = worth(NoiseRatios(19.8, None), NoiseRatios(19.7, None))
    assert taken.fitted == pytest.approx(0.01, abs=0.001)
    assert not taken.earns_a_name


@pytest.mark.parametrize(
    ("fitted", "held_out", "earns"),
    [
        (EARNS, None, True),
        (EARNS - 0.01, None, False),
        (EARNS, EARNS_HELD_OUT, True),
        (1.0, EARNS_HELD_OUT - 0.01, False),
        (1.0, -3.0, False),
    ],
)
def test_a_share_counts_where_fitted_and_where_held_out(fitted: float, held_out: float | None, earns: bool) -> None:
    assert Worth(fitted, held_out).earns_a_name == earns


def test_held_out_records_that_nothing_is_missing_in_do_not_test_an_effect() -> None:
    assert worth(NoiseRatios(3.0, 1.1), NoiseRatios(1.0, 1.05)).held_out is None


def test_an_effect_that_spoils_held_out_records_which_were_explained_has_no_name() -> None:
    taken = worth(NoiseRatios(3.0, 1.1), NoiseRatios(1.0, 4.0))
    assert taken.held_out is not None
    assert not taken.earns_a_name


def test_a_noise_that_is_overrated_does_not_hide_an_effect() -> None:
    """The rest after it is the floor then."""
    assert worth(NoiseRatios(0.99, None), NoiseRatios(0.8, None)).fitted == 1.0


def test_records_are_judged_where_fitted_and_where_held_out_each_by_its_own_noise() -> None:
    seen = observations(BOUC_WEN, 0.02, 3)
    judge = Judge.of(seen[:2], seen[2:])
    ratios = judge.noise_ratios(SOFT)
    data = FitData.by_noise(seen)
    right, wrong = at_values(data, BOUC_WEN), judge.noise_ratios(BOUC_WEN)
    assert wrong.fitted == pytest.approx(1.0, abs=0.05)
    assert wrong.held_out == pytest.approx(1.0, abs=0.05)
    floor = np.array([noise_rms(one) for one in data.whitenings])
    assert rms_by_record(data, right.residual)[2] / floor[2] == pytest.approx(wrong.held_out, abs=0.02)
    assert ratios.fitted > 3
    assert ratios.held_out is not None
    assert ratios.held_out > 3
