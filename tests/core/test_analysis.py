import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from building_models import BASE, GROUND, LAYER, ROOF, bncs, bncs_segments, exact, paper, records, segments
from ground_motions import RATE, akt013
from shared_data import needs_shared

from core.analysis import AnalysisSettings, DirectionAnalysis, analyse
from core.errors import ModelError
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR

CHAIN = AnalysisSettings(band=(0.1, 25.0))
EVENTS = ("CNP100", "LAC100", "SP100")


@cache
def analysed(event: str) -> DirectionAnalysis:
    """The real building under one of EVENTS."""
    return analyse(bncs_segments(event), bncs(), CHAIN).directions["x"]


def fit(truth: np.ndarray, estimate: np.ndarray) -> float:
    return float(100 * (1 - np.linalg.norm(truth - estimate) / np.linalg.norm(truth - truth.mean())))


@pytest.mark.accuracy
@needs_shared
@pytest.mark.parametrize(
    ("sensors", "published"),
    [(("base slab", "4", "roof"), (99.0, 98.7, 97.9)), (("base slab", "roof"), (95.0, 92.3, 89.2))],
)
def test_force_of_the_real_building(sensors: tuple[str, ...], published: tuple[float, ...]) -> None:
    """Against F = −Σ m_i a_i over all six levels, 0.1-25 Hz; printed to a tenth of a point."""
    for event, expected in zip(EVENTS, published, strict=True):
        truth = analysed(event).restoring_force.force
        some = analyse(bncs_segments(event), bncs(), replace(CHAIN, sensors=sensors, estimator="cms")).directions["x"]
        assert fit(truth, some.restoring_force.force) == pytest.approx(expected, abs=0.1)


@pytest.mark.accuracy
@needs_shared
def test_stiffness_of_the_real_building_falls_with_amplitude() -> None:
    """From about 9 kN/mm at 5 mm to 4.4 at 50-100 mm, as its description says: read off to 15 %."""
    results = [analysed(event).equivalent for event in EVENTS]
    a, k = np.array([(s.amplitude, s.k_eq) for one in results for s in one]).T
    small = np.median(k[(a > 0.004) & (a < 0.006)])
    large = np.median(k[(a > 0.05) & (a < 0.1)])
    assert (small / 1e6, large / 1e6) == (pytest.approx(9, rel=0.15), pytest.approx(4.4, rel=0.15))


@needs_shared
def test_no_cycle_of_the_real_building_is_out_of_line() -> None:
    """k_eq against amplitude by a power law of a log-linear exponent: from 1 mm on, 19 of 20 cycles within 20 %.

    The farthest of 90 lies 0.28 off in log k, a cycle of 4 mm.
    """
    results = [analysed(event).equivalent for event in EVENTS]
    a, k = np.array([(s.amplitude, s.k_eq) for one in results for s in one if s.amplitude > 0.001]).T
    off = np.abs(np.log(k) - np.polyval(np.polyfit(np.log(a), np.log(k), 2), np.log(a)))
    assert len(a) > 50
    assert np.quantile(off, 0.95) < 0.2
    assert off.max() < 0.3


def test_force_of_the_papers_building() -> None:
    """AKT013 at 1 % noise: 97.1 by the reference prototype of the paper's way, within 0.3 points.

    The smoother's 99.8 lose up to 0.6 points to the chain's high-pass at 0.1 Hz, since the truth has what is slower.
    """
    truth = simulate(BUILDING, ISOLATOR, akt013(), RATE).force
    result = analyse(segments(records(1)), paper(), AnalysisSettings())
    assert fit(truth, result.directions["x"].restoring_force.force) > 99.2
    as_published = analyse(segments(records(1)), paper(), AnalysisSettings(estimator="cms"))
    assert fit(truth, as_published.directions["x"].restoring_force.force) == pytest.approx(97.1, abs=0.3)
    assert result.pga == pytest.approx(np.abs(akt013()).max(), rel=0.02)
    assert set(result.peaks) == {channel.id for channel in paper().channels}


def test_the_same_input_gives_the_same_result_and_it_can_be_sent_to_another_process() -> None:
    one, two = (analyse(segments(records(2)), paper(), AnalysisSettings()) for _ in range(2))
    assert pickle.dumps(one) == pickle.dumps(two)


def test_an_unknown_level_is_refused_with_the_known_ones() -> None:
    result = analyse(segments(records(3)), paper(), AnalysisSettings(sensors=("1F", "attic")))
    assert result.directions == {}
    assert "no level is called ['attic']" in str(result.refusal)
    assert "'RF'" in str(result.refusal)


def test_an_unknown_estimator_is_an_error_with_the_known_ones() -> None:
    """It is the caller's fault, not the data's."""
    with pytest.raises(ModelError, match="no estimator is called 'x'; there are cms, smoother"):
        analyse(segments(records(3)), paper(), AnalysisSettings(estimator="x"))


def test_nothing_at_all_is_refused() -> None:
    result = analyse([], paper(), AnalysisSettings())
    assert result.directions == {}
    assert BASE in str(result.refusal)


@pytest.mark.accuracy
def test_without_a_transducer_the_displacement_is_integrated_and_stated_to_be() -> None:
    samples = {channel: values for channel, values in records(4, 0.0).items() if channel != LAYER}
    result = analyse(segments(samples), paper(), AnalysisSettings())
    truth = exact(akt013, 1.0)[-1]
    assert fit(truth, result.directions["x"].displacement) > 95  # the high-pass at 0.1 Hz takes 2-3 %
    assert "displacement" in {finding.kind for finding in result.quality}


def test_without_ground_and_transducer_there_is_a_force_but_no_cycle() -> None:
    samples = {channel: values for channel, values in records(5).items() if channel not in (LAYER, GROUND)}
    direction = analyse(segments(samples), paper(), AnalysisSettings()).directions["x"]
    assert direction.displacement is None
    assert direction.equivalent == ()
    assert direction.restoring_force.force.size == 18000


def test_a_record_of_garbage_is_refused_not_raised() -> None:
    rng = np.random.default_rng(6)
    for samples in (np.full(50, np.nan), rng.standard_normal(3), np.zeros(5000), np.array([])):
        result = analyse(segments(dict.fromkeys((BASE, ROOF, LAYER, GROUND), samples)), paper(), AnalysisSettings())
        assert result.refusal
