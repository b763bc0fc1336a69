"""Measures of shaking against published programs, and the floors' motion against a simulated building."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from building_models import GROUND, paper, records, segments
from ground_motions import RATE, akt013, chi_chi, kobe

from core.analysis import analyse
from core.arrays import Vector
from core.description import IsolationLayer
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from core.record import Channel, Record
from core.shaking.classes import long_period_class
from core.shaking.intensity import instrumental_intensity, long_period_velocity
from core.shaking.measures import arias_intensity, shaking, significant_duration
from core.shaking.oscillators import oscillator_motion, response_spectrum


@pytest.mark.parametrize(
    ("motions", "published"),
    [((kobe,), 3.79415), ((kobe, chi_chi), 4.04365), ((kobe, chi_chi, akt013), 4.05157), ((akt013,), 3.70981)],
)
def test_intensity_is_that_of_pyshindo(motions: tuple[Callable[[], Vector], ...], published: float) -> None:
    """`calculate_measured_intensity(..., unit="m/s^2").intensity_raw` of pyshindo 0.3.2."""
    assert instrumental_intensity(np.array([one() for one in motions]), RATE) == pytest.approx(published, abs=1e-5)


def test_five_lower_begins_at_its_definition() -> None:
    """A sine of 1 Hz passes the filter by a known factor; 10^1.78 gal exceeded for 0.3 s give 4.5."""
    time = np.arange(6000) / RATE
    sine = np.sin(2 * np.pi * time)
    high_cut = 1 + 0.694e-2 + 0.241e-4 + 0.0557e-6
    gain = np.sqrt(1 - np.exp(-(2.0**3))) / np.sqrt(high_cut)
    strongest = np.sort(np.abs(sine))[::-1][29]
    scale = 10 ** ((4.5 - 0.94) / 2) / 100 / gain / strongest
    assert instrumental_intensity(scale * sine[None], RATE) == pytest.approx(4.5, abs=1e-4)


def test_intensity_without_motion_has_no_number() -> None:
    assert instrumental_intensity(np.zeros((3, 1000)), RATE) == -np.inf


def test_long_period_motion_is_that_of_pyshindo() -> None:
    """`calculate_long_period_class(...).max_sva_cm_s` of pyshindo 0.3.2 is 28.4271 cm/s."""
    velocity = long_period_velocity(np.array([kobe(), chi_chi()]), RATE)
    assert velocity == pytest.approx(0.284271, rel=1e-4)
    assert [long_period_class(one) for one in (0.049, 0.05, velocity, 0.5, 1.0)] == [0, 1, 2, 3, 4]


def test_spectrum_arias_intensity_and_duration_are_those_of_eqsig() -> None:
    """`pseudo_response_spectra`, `calc_arias_intensity` (g = 9.81 m/s²) and `calc_sig_dur_vals` of eqsig 1.2.17."""
    periods = np.array([0.1, 0.3, 1.0, 3.0, 8.0])
    published = [0.960329769, 1.464982082, 0.400840309, 0.091238685, 0.022112554]
    assert response_spectrum(kobe(), RATE, periods) == pytest.approx(published, rel=1e-6)
    assert arias_intensity(kobe(), RATE) == pytest.approx(0.045818957, rel=1e-3)
    assert significant_duration(kobe()[None], RATE) == pytest.approx(11.22, abs=0.011)


def test_an_oscillator_follows_a_ramp_exactly() -> None:
    """Support accelerating by a = t: u = -(t - 2ζ/ω + e^(-ζωt) (2ζ/ω cos ω_d t + (2ζ² - 1)/ω_d sin ω_d t)) / ω²."""
    ω, ζ, time = 2 * np.pi, 0.05, np.arange(300) / RATE
    ωd = ω * np.sqrt(1 - ζ**2)
    free = np.exp(-ζ * ω * time) * (2 * ζ / ω * np.cos(ωd * time) + (2 * ζ**2 - 1) / ωd * np.sin(ωd * time))
    u, v = oscillator_motion(time, RATE, ω, ζ)
    exact = -(time - 2 * ζ / ω + free) / ω**2
    assert np.abs(u - exact).max() < 1e-12
    assert np.abs(np.gradient(exact, 1 / RATE) - v)[1:-1].max() < 1e-4


def test_a_missing_ground_gives_the_base_slab_as_a_lower_bound() -> None:
    levels = {"ground": kobe(), "1F": kobe() / 3}
    channels = tuple(Channel(name, name, "acceleration", "x") for name in levels)
    both = Record(
        start=segments(records(1))[0].start, rate=RATE, channels=channels, samples=np.array([*levels.values()])
    )
    ground = shaking(both, paper())
    base = shaking(replace(both, channels=channels[1:], samples=both.samples[1:]), paper())
    assert ground is not None
    assert base is not None
    assert (ground.is_below_isolators, base.is_below_isolators) == (True, False)
    assert base.intensity == pytest.approx(ground.intensity - 2 * np.log10(3), abs=1e-9)
    assert shaking(replace(both, channels=(), samples=both.samples[:0]), paper()) is None


def test_storey_drift_and_floors_of_a_simulated_building() -> None:
    """Two of seven floors are measured; drift lies within its 95 %, and unmeasured floors within theirs."""
    moved = simulate(BUILDING, ISOLATOR, akt013(), RATE)
    drift = np.abs(np.diff(moved.floor_displacement, axis=0, prepend=0.0)).max(axis=1)
    floors = np.abs(moved.floor_acceleration).max(axis=1)
    result = analyse(segments(records(7)), paper())
    [motion] = result.floors
    for one, exact in zip(motion.storeys, drift, strict=True):
        assert abs(one.peak - exact) < 2 * one.std
        assert one.std < 0.5 * one.peak
    by_level = {one.level: one for one in motion.accelerations}
    for level, exact in zip(paper().floors, floors, strict=True):
        one = by_level[level.name]
        assert one.std is not None
        assert abs(one.peak - exact) < max(2 * one.std, 0.1 * exact)
    assert [one.level for one in motion.accelerations if one.is_measured] == ["1F", "4F", "RF"]


def test_an_analysis_measures_the_shaking_and_the_travel() -> None:
    result = analyse(segments(records(7)), replace(paper(), isolation=IsolationLayer(0.2)))
    assert result.shaking is not None
    assert result.shaking.level == "ground"
    assert result.shaking.pga == pytest.approx(result.peaks[GROUND])
    assert result.travel is None  # one direction of two
