import numpy as np
import pytest

from core.errors import RecordError
from core.forecasting.ground_motion import GroundMotion, ToDisplacement, ToPga, ToSpectrum, to_pga, to_spectrum
from core.shaking.oscillators import response_spectrum

RATE = 100.0
RNG = np.random.default_rng(1)
X, Y = RNG.standard_normal((2, 3000))
PERIODS = np.geomspace(0.2, 8.0, 200)


def motion() -> GroundMotion:
    return GroundMotion.of("wave", RATE, x=X, y=0.5 * Y)


def test_a_motion_is_scaled_to_the_stronger_components_peak() -> None:
    scaled = motion().times(to_pga(motion(), ToPga(3.0)))
    assert scaled.pga == pytest.approx(3.0)
    assert scaled.accelerations["y"] == pytest.approx(0.5 * Y * 3.0 / np.abs(X).max())


def test_a_motion_is_scaled_to_a_design_spectrum_of_its_own_shape() -> None:
    """1 %: the spectrum is interpolated between 200 periods."""
    own = np.sqrt(response_spectrum(X, RATE, PERIODS) * response_spectrum(0.5 * Y, RATE, PERIODS))
    wanted = ToSpectrum(tuple(PERIODS), tuple(2.5 * own))
    assert to_spectrum(motion(), wanted, period=2.0) == pytest.approx(2.5, rel=0.01)


def test_only_the_periods_about_the_buildings_count() -> None:
    own = response_spectrum(X, RATE, PERIODS)
    near = np.where(PERIODS > 1.0, 2.0, 7.0) * own
    wanted = ToSpectrum(tuple(PERIODS), tuple(near))
    assert to_spectrum(motion().only("x"), wanted, period=3.0) == pytest.approx(2.0, rel=0.01)


def test_a_design_spectrum_must_reach_the_buildings_period() -> None:
    with pytest.raises(
        RecordError, match=r"given from 0.1 to 1 s; the building on its isolators needs it within 1.5 to"
    ):
        to_spectrum(motion(), ToSpectrum((0.1, 1.0), (3.0, 3.0)), period=3.0)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"x": [0.0, np.nan, *X]}, "direction x: it has gaps"),
        ({"x": 1000 * X}, "reaches .* m/s², more than any earthquake; .* 1 gal is 0.01 m/s²"),
        ({"z": X}, "no horizontal acceleration"),
        ({"x": X, "y": Y[:-1]}, "series of one length"),
        ({"x": [X, X]}, "series of one length"),
        ({"x": 0 * X}, "the ground does not move"),
        ({"x": X[:5]}, "5 samples are too few"),
    ],
)
def test_what_is_no_ground_motion_is_refused_with_the_reason(given: dict[str, object], reason: str) -> None:
    with pytest.raises(RecordError, match=f"wave.*{reason}"):
        GroundMotion.of("wave", RATE, **given)  # type: ignore[arg-type]  # the point of the test


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan])
def test_a_rate_must_be_positive(rate: float) -> None:
    with pytest.raises(RecordError, match="sampling rate must be positive"):
        GroundMotion.of("wave", rate, x=X)


@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan, 1e3])
def test_impossible_sizes_are_refused(value: float) -> None:
    with pytest.raises(RecordError, match="cannot be scaled to a peak ground acceleration"):
        ToPga(value)
    with pytest.raises(RecordError, match="cannot be scaled to a displacement"):
        ToDisplacement(value)


@pytest.mark.parametrize(("factor", "reason"), [(0.0, "positive number"), (np.nan, "positive"), (1e3, "beyond 100")])
def test_impossible_factors_are_refused(factor: float, reason: str) -> None:
    with pytest.raises(RecordError, match=reason):
        motion().times(factor)


@pytest.mark.parametrize(
    ("periods", "acceleration"), [((1.0,), (1.0,)), ((2.0, 1.0), (1.0, 1.0)), ((1.0, 2.0), (1.0, -1.0))]
)
def test_a_spectrum_has_rising_periods_and_positive_values(
    periods: tuple[float, ...], acceleration: tuple[float, ...]
) -> None:
    with pytest.raises(RecordError, match="design spectrum"):
        ToSpectrum(periods, acceleration)
