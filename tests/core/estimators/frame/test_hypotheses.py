from dataclasses import replace

import numpy as np
import pytest
from exact_spectra import (
    DESIGN,
    PAPER,
    exact_lines,
    known_superstructure,
    white_noise,
    with_noise,
    with_rocking,
    with_sensor_fault,
)
from scipy.linalg import eigh

from core.estimators.frame.calibration import (
    Calibration,
    best_start,
    calibrated,
    log_evidence,
    on_all_lines,
    on_some_lines,
)
from core.estimators.frame.evaluation import Problem, evaluated
from core.estimators.frame.hypotheses import (
    MISSED,
    NOISE_TOLERANCE,
    as_given,
    best_hypothesis,
    corrected,
    unexplained,
    with_modal_damping,
    with_unmodelled_motion,
)
from core.estimators.frame.model import Design

LAYOUT = DESIGN.layout
AS_GIVEN, CORRECTED, UNMODELLED = (making(DESIGN, 0.0).name for making in (as_given, corrected, with_unmodelled_motion))
NOISE = 0.02
LATE = 0.01
"""s: one sample."""
WITHIN = 4.0
"""Standard deviations, by which an error may be of what is said of it."""


def difference(calibration: Calibration, parameters: slice, channel: int) -> tuple[float, float]:
    """A channel's parameter less the others' mean, and its standard deviation; a common one is no fault."""
    weights = np.full(LAYOUT.channels, -1 / (LAYOUT.channels - 1))
    weights[channel] = 1.0
    covariance = calibration.covariance[parameters, parameters]
    return float(weights @ calibration.parameters[parameters]), float(np.sqrt(weights @ covariance @ weights))


def test_what_was_reported_is_kept_where_it_holds() -> None:
    rng = np.random.default_rng(1)
    choice = best_hypothesis(with_noise(exact_lines(PAPER, rng), NOISE, rng), DESIGN, 0.0)
    assert choice.calibration.hypothesis.name == AS_GIVEN
    degrees = choice.calibration.degrees_of_freedom
    assert choice.chi_square == pytest.approx(1.0, abs=WITHIN / np.sqrt(degrees))


@pytest.mark.parametrize("channel", range(LAYOUT.channels))
def test_a_late_clock_is_detected(channel: int) -> None:
    rng = np.random.default_rng([2, channel])
    choice = best_hypothesis(
        with_noise(with_sensor_fault(exact_lines(PAPER, rng), channel, 1.0, LATE), NOISE, rng), DESIGN, 0.0
    )
    assert choice.calibration.hypothesis.name == CORRECTED
    delay, std = difference(choice.calibration, LAYOUT.delays, channel)
    assert delay == pytest.approx(LATE, abs=WITHIN * std)
    assert std < LATE / 5  # less would be no finding


@pytest.mark.parametrize("channel", range(LAYOUT.channels))
def test_a_gain_is_corrected(channel: int) -> None:
    """Two percent, as well as its standard deviation says."""
    rng = np.random.default_rng([3, channel])
    choice = best_hypothesis(
        with_noise(with_sensor_fault(exact_lines(PAPER, rng), channel, 1.02, 0.0), NOISE, rng), DESIGN, 0.0
    )
    assert choice.calibration.hypothesis.name.startswith(CORRECTED)  # each mode may have a damping of its own
    gain, std = difference(choice.calibration, LAYOUT.gains, channel)
    assert gain == pytest.approx(np.log(1.02), abs=WITHIN * std)
    assert std < 0.02 / 4  # less would be no finding


@pytest.mark.parametrize("seed", range(3))
def test_floor_masses_are_corrected(seed: int) -> None:
    """Scattered by 20 %, their total as given.

    From two floors single masses are known in part only; what counts, the first mode's share of the mass, is known to
    half a percent, where that of the given masses is wrong by up to 2.
    """
    rng = np.random.default_rng([4, seed])
    drawn = PAPER.mass * (1 + 0.2 * rng.standard_normal(PAPER.mass.size))
    known = replace(PAPER, mass=drawn * PAPER.mass.sum() / drawn.sum())
    choice = best_hypothesis(with_noise(exact_lines(known, rng), NOISE, rng), DESIGN, 0.0)
    assert choice.calibration.hypothesis.name == CORRECTED
    result = choice.calibration.structure
    true = eigh(known.stiffness, np.diag(known.mass))[1]
    modes = ((result.shapes, result.mass), (true, known.mass))
    shares = [(shapes[:, 0] @ mass) ** 2 / mass.sum() for shapes, mass in modes]
    assert shares[0] == pytest.approx(shares[1], abs=0.005)


@pytest.mark.parametrize("seed", range(2))
def test_modes_may_be_damped_each_by_itself(seed: int) -> None:
    """By 1 to 4 % as it happens: those of the first four modes, all but 1 % of the mass, agree to 3 %."""
    rng = np.random.default_rng([9, seed])
    ratios = rng.uniform(0.01, 0.04, PAPER.mass.size)
    known = replace(PAPER, damping=(0.0, 2.0, 0.0), modal_damping=tuple(ratios))
    choice = best_hypothesis(with_noise(exact_lines(known, rng), NOISE, rng), DESIGN, 0.0)
    given = as_given(DESIGN, 0.0), corrected(DESIGN, 0.0)  # often a tie
    assert choice.calibration.hypothesis.name in {with_modal_damping(one, LAYOUT).name for one in given}
    assert choice.calibration.structure.damping_ratios[:4] == pytest.approx(ratios[:4], rel=0.03)


@pytest.mark.parametrize("seed", range(4))
def test_dampings_of_the_modes_are_seen_in_strong_noise(seed: int) -> None:
    """With noise of 20 % in every channel, the damping ratios of the first three modes agree to 10 %.

    The determinant along each hypothesis' own response hid them in three of these four cases.
    """
    rng = np.random.default_rng([21, seed])
    ratios = rng.uniform(0.01, 0.04, PAPER.mass.size)
    known = replace(PAPER, damping=(0.0, 2.0, 0.0), modal_damping=tuple(ratios))
    choice = best_hypothesis(with_noise(exact_lines(known, rng), 10 * NOISE, rng), DESIGN, 0.0)
    assert choice.calibration.structure.damping_ratios[:3] == pytest.approx(ratios[:3], rel=0.1)


@pytest.mark.accuracy
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_rocking_of_its_own_is_unmodelled_motion(share: float) -> None:
    rng = np.random.default_rng(5)
    choice = best_hypothesis(
        with_noise(with_rocking(exact_lines(PAPER, rng), PAPER, share, rng), NOISE, rng), DESIGN, 0.0
    )
    assert choice.calibration.hypothesis.name == UNMODELLED
    assert choice.chi_square > NOISE_TOLERANCE


def test_foreign_motion_of_a_floor_is_unmodelled() -> None:
    """As of a machine, or of a floor that is no lumped mass: a tenth of the roof's motion, unlike everything else."""
    rng = np.random.default_rng(6)
    lines = exact_lines(PAPER, rng)
    roof = lines.spectra.copy()
    roof[2] += 0.1 * np.std(roof[2]) * white_noise(lines.angular.size, rng)
    choice = best_hypothesis(with_noise(replace(lines, spectra=roof), NOISE, rng), DESIGN, 0.0)
    assert choice.calibration.hypothesis.name == UNMODELLED


def test_misfit_of_a_band_is_unexplained() -> None:
    """One band of eight with three times the noise, by its excess over what noise would leave."""
    rng, hypothesis = np.random.default_rng(7), as_given(DESIGN, 0.0)
    lines = with_noise(exact_lines(PAPER, rng), NOISE, rng)
    problem = Problem(lines, DESIGN, hypothesis)
    calibration = calibrated(problem, best_start(problem))
    assert unexplained(calibration, lines) < 4
    band = 5
    misfit = calibration.misfit_by_band.copy()
    misfit[band] *= 3
    count = np.sum(lines.band == band) * 2
    expected = (misfit[band] - count) / np.sqrt(count)
    assert unexplained(replace(calibration, misfit_by_band=misfit), lines) == pytest.approx(expected)


@pytest.mark.parametrize(("measured", "is_free"), [([6], False), ([2, 6], True)])
def test_joints_and_bending_are_reported_only_by_enough_channels(measured: list[int], is_free: bool) -> None:
    design = Design.of(DESIGN.floor_mass, None, np.array(measured))
    flexibilities = design.layout.flexibilities
    places = set(range(flexibilities.start + 1, flexibilities.stop))
    for making in (as_given, corrected, with_unmodelled_motion):
        assert places & set(making(design, 0.0).free) == (places if is_free else set())


def test_transients_are_free_where_the_record_does_not_rest() -> None:
    for making in (as_given, corrected, with_unmodelled_motion):
        assert not set(making(DESIGN, 0.0).free) & set(range(LAYOUT.transients.start, LAYOUT.transients.stop))
        assert set(range(LAYOUT.transients.start, LAYOUT.transients.stop)) <= set(making(DESIGN, 2.0).free)


def test_the_lowest_storey_has_the_scale_alone() -> None:
    for making in (as_given, corrected, with_unmodelled_motion):
        hypothesis = making(DESIGN, 0.0)
        assert LAYOUT.scale in hypothesis.free
        assert LAYOUT.storeys.start not in hypothesis.free
        at = known_superstructure(hypothesis.mean, DESIGN)
        assert np.isfinite(at.stiffness).all()


@pytest.mark.accuracy
@pytest.mark.parametrize("share", [0.0, 0.01, 0.1])
def test_some_lines_show_the_evidence_nearly_as_well_as_all(share: float) -> None:
    """Every fifth line of a record of 240 s, so that the wider hypothesis is not dropped where it would win."""
    rng = np.random.default_rng([8, round(100 * share)])
    lines = with_noise(with_rocking(exact_lines(PAPER, rng, samples=24_000), PAPER, share, rng), NOISE, rng)
    wider = Problem(lines, DESIGN, with_unmodelled_motion(DESIGN, 0.0))
    near = on_some_lines(wider, best_start(wider))
    every = on_all_lines(wider, near)
    assert near.lines < every.lines / 4
    along = evaluated(wider, every.parameters, every.variances).given.base
    missed = log_evidence(every, wider, along) - log_evidence(near, wider, along)
    assert 0 < missed < MISSED
