"""Hypotheses about the superstructure and its sensors, and the choice between them by the record's evidence."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Vector
from core.estimators.frame.calibration import (
    ENOUGH,
    Calibration,
    best_by_some_lines,
    best_start,
    calibrated,
    log_evidence,
    on_all_lines,
    on_some_lines,
    promised,
    some_lines,
)
from core.estimators.frame.evaluation import Hypothesis, Problem, evaluated
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design, Layout

STOREYS = 0.3
"""Standard deviation of the logarithm of a storey's stiffness over that of the one below, about the design's. A
choice."""
EVEN_STOREYS = 0.15
"""The same where masses are uncertain: an uneven building is then rather one of uneven masses."""
MASSES = 0.15
"""Standard deviation of the logarithm of a floor's mass over the given one, where masses are uncertain. A choice."""
GAINS = 0.02
"""Standard deviation of the logarithm of a sensor's gain, where sensors are uncertain. A choice."""
DELAYS = 0.01
"""s, standard deviation of a sensor's clock, where sensors are uncertain. A choice."""
FLEXIBILITIES = ((0.1, 1.5), (0.3, 1.0), (0.05, 1.5))
"""Median and standard deviation of the logarithm: of rocking, of the joints, of bending as a whole. A choice."""
JOINTS_IDENTIFIED_FROM = 3
"""Channels needed to distinguish the joints' rotation from the storeys' own shear; with fewer, joints are rigid."""
RIGID = 1e-3
"""Flexibility of practically rigid joints. A choice."""
DAMPING = ((0.002, 1.5), (0.02, 1.5), (0.1, 1.5))
"""The same of α in s, η, and β in 1/s: each alone would damp a mode of 1 Hz by about 1 %."""
MODAL_DAMPING = 0.4
"""Standard deviation of the logarithm of a mode's damping over what these give it. A choice."""
NOISE_TOLERANCE = 1.25
"""Largest factor of the noise's power over that of the quiet part of the record. A choice."""
ANNEALING = (1000.0, 30.0)
"""Factors on the noise's power, in turn, before it is used as it is. A choice."""
UNDECIDED = 6.0
"""Difference of log evidence, for each channel, that counts as a tie: a gain and a clock that are right as given cost
about as much. With three channels and floor masses that are wrong by 20 %, correcting them was up to 18 less evident in
28 of 30 records with 5 and 10 % noise (even draws), while the force of the given ones erred by up to 5 %."""
MISSED = 75.0
"""Most log evidence that parameters from some of the lines lack, about half of their number times one less than the
lines for each that is used; in simulation it was 18 to 59."""
BEYOND_DOUBT = 2 * MISSED
"""Log evidence of unmodelled motion, by calibrations from some of the lines, at which the other hypotheses are not
calibrated by all lines. These gained up to 39 by them, and by dampings of the modes up to half of what they promise, in
nine records of a simulated, of the demonstration's and of a real building. A choice."""
EVIDENT = 15.0
"""Log evidence that separate damping of every mode must gain. Without need it gained up to 12 (truths of
tests/support/exact_responses.py at 5 and 10 % noise), where it was needed 20 and more."""
UNEXPLAINED = 4.0
"""Standard deviations of a band's misfit above the record's, beyond which noise alone does not explain it. A choice."""
TEMPERATURE = 100.0
"""Difference of log evidence at which the weight of a hypothesis falls to 1/e.

It would be 1 if one of the hypotheses were the building. Where none is, evidence preferred the less exact of two by up
to 120. Chosen on even seeds of tests/support/band_coverage.py."""
NEGLIGIBLE = 0.02
"""Weight below which a hypothesis is left out. A choice."""


def as_given(design: Design, transient: float) -> Hypothesis:
    """Masses and sensors are as given; stiffness and damping are free.

    Args:
        design: of the building.
        transient: m/s² kg^½, of the free vibration at the record's ends; 0 for a record that begins and ends at rest.
    """
    layout = design.layout
    mean, std = np.zeros(layout.size), np.zeros(layout.size)
    std[layout.scale] = 10.0
    std[layout.storeys] = STOREYS
    std[layout.storeys.start] = 0.0
    mean[layout.flexibilities], std[layout.flexibilities] = _lognormal(FLEXIBILITIES)
    if layout.channels < JOINTS_IDENTIFIED_FROM:
        mean[layout.flexibilities][1:], std[layout.flexibilities][1:] = np.log(RIGID), 0.0
    mean[layout.damping], std[layout.damping] = _lognormal(DAMPING)
    std[layout.transients] = transient
    return Hypothesis("masses and sensors as given", mean, std, is_random=False)


def corrected(design: Design, transient: float) -> Hypothesis:
    """The distribution of the floors' mass, the sensors' gains and their clocks may be wrong too."""
    layout, given = design.layout, as_given(design, transient)
    std = given.std.copy()
    std[layout.storeys][1:] = EVEN_STOREYS
    std[layout.masses], std[layout.gains], std[layout.delays] = MASSES, GAINS, DELAYS
    return replace(given, name="masses and sensors corrected", std=std)


def with_unmodelled_motion(design: Design, transient: float) -> Hypothesis:
    """The base slab rocks, and the floors move, beyond what any of the parameters explains."""
    given = as_given(design, transient)
    return replace(given, name="motion that the model does not explain", is_random=True)


def with_modal_damping(hypothesis: Hypothesis, layout: Layout) -> Hypothesis:
    """The hypothesis with a damping of its own for every mode."""
    std = hypothesis.std.copy()
    std[layout.modal_damping] = MODAL_DAMPING
    return replace(hypothesis, name=f"{hypothesis.name}, every mode with a damping of its own", std=std)


def _lognormal(priors: tuple[tuple[float, float], ...]) -> tuple[Vector, Vector]:
    return np.log([median for median, _ in priors]), np.array([std for _, std in priors])


@dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """A hypothesis that was not chosen."""

    calibration: Calibration
    weight: float
    """1 for as much evidence as the chosen one has."""


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The calibration of most evidence, and the lines with the noise it assumes."""

    calibration: Calibration
    lines: Lines
    chi_square: float
    """Chi-square per degree of freedom by noise alone: about 1 where no motion is left unmodelled."""
    rivals: tuple[Rival, ...] = ()
    """Other hypotheses that the record does not rule out; none beside unmodelled motion, which allows for more."""
    masses_as_given: Calibration | None = None
    """The most evident one with the masses as given, where the chosen one corrects them."""
    evidence_of_masses: float = 0.0
    """Log evidence of the masses as given over masses that are corrected; 0 beside unmodelled motion."""


Evidence = Callable[[Calibration, Lines], float]
"""Log evidence of a calibration by lines with their noise."""


def best_hypothesis(lines: Lines, design: Design, transient: float) -> Choice:
    """The hypothesis that the record supports, by its evidence.

    Modes with a damping of their own are considered where they promise enough evidence, unmodelled motion only where
    some band of frequencies is not explained by noise.
    """
    given = Problem(lines, design, as_given(design, transient))
    doubt = replace(given, hypothesis=corrected(design, transient))
    wide = replace(given, hypothesis=with_unmodelled_motion(design, transient))
    start = best_start(given)  # of both: what only one of them leaves free starts where the other fixes it
    near = [on_some_lines(given, start), on_some_lines(doubt, _annealed(doubt, start))]
    evidence = _evidence(given, near[0])
    rough = _choice(near, lines, evidence)
    unmodelled = _unmodelled(rough, replace(wide, lines=rough.lines))
    if unmodelled is not None and _is_beyond_doubt(unmodelled, rough, given, evidence):
        return replace(rough, calibration=on_all_lines(replace(wide, lines=rough.lines), unmodelled))
    calibrations = [on_all_lines(given, near[0]), on_all_lines(doubt, near[1])]
    evidence = _evidence(given, calibrations[0])
    choice = _choice(calibrations, lines, evidence)
    by_mode = replace(given, hypothesis=with_modal_damping(choice.calibration.hypothesis, design.layout))
    if promised(choice.calibration, by_mode) > EVIDENT:
        each = [_damped_by_mode(one, lines, design) for one in calibrations]
        calibrations, damped = calibrations + each, _choice(each, lines, evidence)
        if evidence(damped.calibration, damped.lines) > evidence(choice.calibration, damped.lines) + EVIDENT:
            choice = damped
    if unexplained(choice.calibration, choice.lines) > UNEXPLAINED:
        wide = replace(wide, lines=choice.lines)
        unmodelled = unmodelled or on_some_lines(wide, best_start(wide))
        choice = replace(choice, calibration=_or_wider(choice.calibration, wide, unmodelled, evidence))
    return choice if choice.calibration.hypothesis.is_random else _with_rivals(choice, calibrations, evidence)


def _evidence(given: Problem, calibration: Calibration) -> Evidence:
    """Log evidence with the determinant at one response for all, that of the calibration with the masses as given."""
    along = evaluated(given, calibration.parameters, calibration.variances).given.base

    def evidence(calibration: Calibration, by: Lines) -> float:
        return log_evidence(calibration, replace(given, lines=by), along)

    return evidence


def _unmodelled(rough: Choice, wide: Problem) -> Calibration | None:
    """Unmodelled motion by some of the lines, where these are not explained without it."""
    few = some_lines(wide.lines)
    if unexplained(rough.calibration, few) <= UNEXPLAINED:
        return None
    return on_some_lines(wide, best_start(wide))


def _is_beyond_doubt(unmodelled: Calibration, rough: Choice, given: Problem, evidence: Evidence) -> bool:
    """True if calibrations by all lines, and dampings of the modes, would not make the chosen one as evident."""
    few = some_lines(rough.lines)
    by_mode = with_modal_damping(rough.calibration.hypothesis, given.design.layout)
    promise = promised(rough.calibration, replace(given, lines=few, hypothesis=by_mode))
    gained = evidence(unmodelled, rough.lines) - evidence(rough.calibration, rough.lines)
    return gained > BEYOND_DOUBT + 2 * promise * rough.lines.angular.size / few.angular.size


def _choice(calibrations: list[Calibration], lines: Lines, evidence: Evidence) -> Choice:
    """The calibration with most evidence, with the smallest noise that any of them needs."""
    chi_square = min(calibration.chi_square for calibration in calibrations)
    noisier = replace(lines, noise=lines.noise * float(np.clip(chi_square, 1.0, NOISE_TOLERANCE)))
    return Choice(_most_evident(calibrations, noisier, evidence), noisier, chi_square)


def _with_rivals(choice: Choice, calibrations: list[Calibration], evidence: Evidence) -> Choice:
    """The choice beside what else was calibrated: by masses as given and by corrected ones, in turn."""
    weighed = [(evidence(calibration, choice.lines), calibration) for calibration in calibrations]
    given, doubt = (max(weighed[turn::2], key=lambda pair: pair[0]) for turn in (0, 1))
    is_given = any(calibration is choice.calibration for calibration in calibrations[::2])
    return replace(
        choice,
        rivals=rivals(weighed, choice.calibration),
        masses_as_given=None if is_given else given[1],
        evidence_of_masses=given[0] - doubt[0],
    )


def rivals(candidates: Sequence[tuple[float, Calibration]], best: Calibration) -> tuple[Rival, ...]:
    """The hypotheses that count beside the best.

    They free a parameter that the best fixes. The others are special cases of it, within its own uncertainty.

    Args:
        candidates: log evidence and calibration, the best among them.
        best: the one chosen.
    """
    highest = next(evidence for evidence, calibration in candidates if calibration is best)
    weighed = (
        Rival(calibration, float(np.exp(min(0.0, (evidence - highest) / TEMPERATURE))))
        for evidence, calibration in candidates
        if np.setdiff1d(calibration.hypothesis.free, best.hypothesis.free).size
    )
    return tuple(rival for rival in weighed if rival.weight > NEGLIGIBLE)


def _damped_by_mode(near: Calibration, lines: Lines, design: Design) -> Calibration:
    """Calibration with a damping for every mode, started from the one without: other starts end in local minima."""
    hypothesis = with_modal_damping(near.hypothesis, design.layout)
    return calibrated(Problem(lines, design, hypothesis), near.parameters)


def _or_wider(best: Calibration, wider: Problem, near: Calibration, evidence: Evidence) -> Calibration:
    """The best, or that of the wider hypothesis, calibrated by all lines only if some do not rule it out."""
    if evidence(near, wider.lines) + MISSED < evidence(best, wider.lines):
        return best
    return _most_evident([best, on_all_lines(wider, near)], wider.lines, evidence)


def _annealed(doubt: Problem, start: Vector) -> Vector:
    """Parameters near the best, from a start, by noise that is first far too large and then less so.

    A start at the given masses fails: uneven storeys explain a record nearly as well as uneven masses, and no descent
    leads from one to the other. With little noise the misfit has many minima; with much it has one.
    """
    coarse = doubt.lines.every(max(1, doubt.lines.angular.size // ENOUGH))
    parameters = start
    for power in ANNEALING:
        noisy = replace(doubt, lines=replace(coarse, noise=power * coarse.noise))
        parameters = best_by_some_lines(noisy, parameters)
    return parameters


def unexplained(calibration: Calibration, lines: Lines) -> float:
    """Largest excess of a band's misfit over its expectation, in standard deviations."""
    count = np.bincount(lines.band, minlength=calibration.misfit_by_band.size) * (lines.spectra.shape[0] - 1)
    scale = lines.noise[0] / calibration.noise[0]
    used = count > 0
    excess = (calibration.misfit_by_band[used] / scale - count[used]) / np.sqrt(count[used])
    return float(excess.max())


def _most_evident(calibrations: list[Calibration], lines: Lines, evidence: Evidence) -> Calibration:
    """The one with most free parameters, so of widest uncertainty, among those of nearly equal evidence."""
    weighed = [(evidence(calibration, lines), calibration) for calibration in calibrations]
    least = max(evident for evident, _ in weighed) - UNDECIDED * len(lines.spectra)
    near = [pair for pair in weighed if pair[0] > least]
    return max(near, key=lambda pair: (pair[1].hypothesis.free.size, pair[0]))[1]
