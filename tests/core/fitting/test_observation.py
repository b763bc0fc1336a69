"""A building with a vertical sensor is fitted and compared at every rate and band that the settings accept."""

from dataclasses import replace

import numpy as np
import pytest
from building_models import paper, records, segments
from paper_records import START

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.comparison.compared import compare_forces
from core.fitting.fit import weighted_fit
from core.fitting.observation import Observation, observations
from core.model.isolator import Isolator
from core.record import Channel

VERTICAL = "XX.PAPER.01.HNZ"
BAND = (0.1, 20.0)
"""Hz; at 50 Hz nothing above 25 Hz can be kept."""
LINEAR = Isolator({"elastic": {"k_b": 4e8}, "viscous": {"c_b": 6e6}})


@pytest.fixture(scope="module")
def analysed() -> tuple[EventAnalysis, tuple[Observation, ...]]:
    plain, samples = paper(), records(2)
    building = replace(plain, channels=(*plain.channels, Channel(VERTICAL, "1F", "acceleration", "z")))
    count = next(iter(samples.values())).size
    samples[VERTICAL] = 0.5 * np.sin(2 * np.pi * 3 * np.arange(count) / 100) * np.hanning(count)
    samples[VERTICAL] += 1e-3 * np.random.default_rng(9).standard_normal(count)
    analysis = analyse(segments(samples), building, AnalysisSettings(estimator="cms", rate=50.0, band=BAND))
    return analysis, observations(analysis, building, "one", START)


def test_the_vertical_load_of_an_observation_is_the_analysis_s(
    analysed: tuple[EventAnalysis, tuple[Observation, ...]],
) -> None:
    analysis, (seen,) = analysed
    assert analysis.axial_load is not None
    assert np.array_equal(seen.conditions.axial_load, analysis.axial_load.ratio)
    assert float(np.ptp(seen.conditions.axial_load)) > 0.05


def test_it_is_fitted_and_compared_at_a_low_rate(analysed: tuple[EventAnalysis, tuple[Observation, ...]]) -> None:
    _, seen = analysed
    fit = weighted_fit(seen, LINEAR).fit
    before, after = (compare_forces(model, seen, BAND)[0].misfit.nrmse for model in (LINEAR, fit.model))
    assert after < before < 1.0
