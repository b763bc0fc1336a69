"""What may a superstructure be, and which of that does a record ask for?"""

from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Vector
from core.estimators.frame.calibration import (
    ENOUGH,
    Calibration,
    best_start,
    calibrated,
    log_evidence,
    on_all_lines,
    on_some_lines,
)
from core.estimators.frame.evaluation import Question
from core.estimators.frame.prior import Hypothesis
from core.estimators.frame.rivals import Rival, rivals
from core.estimators.frame.spectral_lines import Lines
from core.estimators.frame.superstructure_model import Design, Layout

STOREYS = 0.3
"""Of the logarithm of a storey's stiffness over that of the one below, about equal columns or about the design."""
EVEN_STOREYS = 0.15
"""The same where masses are doubted: an uneven building is then rather one of uneven masses."""
MASSES = 0.15
"""Of the logarithm of a floor's mass about the one told, where masses are doubted."""
GAINS = 0.02
"""Of the logarithm of a sensor's gain, where sensors are doubted."""
DELAYS = 0.01
"""s, of a sensor's clock, where sensors are doubted."""
FLEXIBILITIES = ((0.1, 1.5), (0.3, 1.0), (0.05, 1.5))
"""Median and standard deviation of the logarithm: of rocking, of the joints, of bending as a whole (see frame.py)."""
TOLD_FROM_JOINTS = 3
"""Channels from which the joints' rotation is told from the storeys' own shear; with fewer, joints are held rigid."""
RIGID = 1e-3
"""Flexibility of joints that are as good as rigid."""
DAMPING = ((0.002, 1.5), (0.02, 1.5), (0.1, 1.5))
"""The same of α in s, η, and β in 1/s: each alone would damp a mode of 1 Hz by about 1 %."""
MODAL_DAMPING = 0.4
"""Of the logarithm of a mode's damping over what these make of it."""
NOISE_TOLERANCE = 1.25
"""The noise's power may be that much above what the quiet part of the record says."""
ANNEALING = (1000.0, 30.0)
"""Of the noise's power, in turn, before it is taken as it is."""
UNDECIDED = 15.0
"""Of log evidence between hypotheses: less is taken for a tie, since Laplace's approximation is no better."""
MISSED = 75.0
"""Of log evidence: the most that parameters found by some of the lines miss, about half of their number times one less
than the lines for each that is used; in simulation it was 18 to 59."""
EVIDENT = 100.0
"""Of log evidence, that dampings of their own must bring: with less they may stand in for floors' masses that are told
wrong, and the force be off by some percent; where a building asked for them they brought thousands."""
UNEXPLAINED = 4.0
"""Standard deviations of a band's misfit above the record's, beyond which noise alone does not explain it."""


def as_told(design: Design, transient: float) -> Hypothesis:
    """Masses and sensors are as told; stiffness and damping are to be found.

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
    if layout.channels < TOLD_FROM_JOINTS:
        mean[layout.flexibilities][1:], std[layout.flexibilities][1:] = np.log(RIGID), 0.0
    mean[layout.damping], std[layout.damping] = _lognormal(DAMPING)
    std[layout.transients] = transient
    return Hypothesis("masses and sensors as told", mean, std, is_random=False)


def corrected(design: Design, transient: float) -> Hypothesis:
    """The distribution of the floors' mass, the sensors' gains and their clocks may be wrong too."""
    layout, told = design.layout, as_told(design, transient)
    std = told.std.copy()
    std[layout.storeys][1:] = EVEN_STOREYS
    std[layout.masses], std[layout.gains], std[layout.delays] = MASSES, GAINS, DELAYS
    return replace(told, name="masses and sensors corrected", std=std)


def with_unmodelled_motion(design: Design, transient: float) -> Hypothesis:
    """The base slab rocks, and the floors move, beyond what any of the parameters explains."""
    told = as_told(design, transient)
    return replace(told, name="motion that the model does not explain", is_random=True)


def with_modal_damping(hypothesis: Hypothesis, layout: Layout) -> Hypothesis:
    """The same, and every mode has a damping of its own."""
    std = hypothesis.std.copy()
    std[layout.modal_damping] = MODAL_DAMPING
    return replace(hypothesis, name=f"{hypothesis.name}, every mode with a damping of its own", std=std)


def _lognormal(priors: tuple[tuple[float, float], ...]) -> tuple[Vector, Vector]:
    return np.log([median for median, _ in priors]), np.array([std for _, std in priors])


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The calibration of most evidence, and the lines with the noise it was judged by."""

    calibration: Calibration
    lines: Lines
    chi_square: float
    """Per degree of freedom, of noise alone: about 1 where a superstructure without unmodelled motion explains all."""
    rivals: tuple[Rival, ...] = ()
    """Other hypotheses that the record does not rule out; none beside unmodelled motion, which allows for more."""


def chosen(lines: Lines, design: Design, transient: float) -> Choice:
    """The hypothesis that the record asks for, by its evidence.

    Modes with a damping of their own, and then unmodelled motion, are considered only where some band of frequencies is
    not explained by noise.
    """
    told = Question(lines, design, as_told(design, transient))
    doubt = replace(told, hypothesis=corrected(design, transient))
    found = [calibrated(told, best_start(told)), calibrated(doubt, _annealed(doubt))]
    choice = _choice(found, told)
    if unexplained(choice.calibration, choice.lines) > UNEXPLAINED:
        by_mode = [_damped_by_mode(one, lines, design) for one in found]
        found, damped = found + by_mode, _choice(by_mode, told)
        asked = replace(told, lines=damped.lines)
        if log_evidence(damped.calibration, asked) > log_evidence(choice.calibration, asked) + EVIDENT:
            choice = damped
    if unexplained(choice.calibration, choice.lines) > UNEXPLAINED:
        wider = Question(choice.lines, design, with_unmodelled_motion(design, transient))
        choice = replace(choice, calibration=_or_wider(choice.calibration, wider))
    return choice if choice.calibration.hypothesis.is_random else _with_rivals(choice, found, told)


def _choice(found: list[Calibration], told: Question) -> Choice:
    """The most evident, by the least noise that one of them asks for."""
    chi_square = min(calibration.chi_square for calibration in found)
    noisier = replace(told.lines, noise=told.lines.noise * float(np.clip(chi_square, 1.0, NOISE_TOLERANCE)))
    return Choice(_most_evident(found, replace(told, lines=noisier)), noisier, chi_square)


def _with_rivals(choice: Choice, found: list[Calibration], told: Question) -> Choice:
    asked = replace(told, lines=choice.lines)
    judged = [(log_evidence(calibration, asked), calibration) for calibration in found]
    return replace(choice, rivals=rivals(judged, choice.calibration))


def _damped_by_mode(near: Calibration, lines: Lines, design: Design) -> Calibration:
    """With a damping for every mode, from what was found without: from nothing, too many valleys lead astray."""
    hypothesis = with_modal_damping(near.hypothesis, design.layout)
    return calibrated(Question(lines, design, hypothesis), near.parameters)


def _or_wider(best: Calibration, wider: Question) -> Calibration:
    """The best, or that of the wider hypothesis, which all lines are asked for only if some do not rule it out."""
    near = on_some_lines(wider, best_start(wider))
    if log_evidence(near, wider) + MISSED < log_evidence(best, wider):
        return best
    return _most_evident([best, on_all_lines(wider, near)], wider)


def _annealed(doubt: Question) -> Vector:
    """Parameters near the best, found with noise that is first far too large and then less so.

    Not from what was told: uneven storeys explain a record nearly as uneven masses do, and no path leads from one to
    the other. With little noise the misfit has many valleys; with much it has one.
    """
    coarse = doubt.lines.every(max(1, doubt.lines.angular.size // ENOUGH))
    found = best_start(doubt)
    for power in ANNEALING:
        noisy = replace(doubt, lines=replace(coarse, noise=power * coarse.noise))
        found = calibrated(noisy, found).parameters
    return found


def unexplained(calibration: Calibration, lines: Lines) -> float:
    """Largest excess of a band's misfit over its expectation, in standard deviations."""
    count = np.bincount(lines.band, minlength=calibration.misfit_by_band.size) * (lines.spectra.shape[0] - 1)
    scale = lines.noise[0] / calibration.noise[0]
    held = count > 0
    excess = (calibration.misfit_by_band[held] / scale - count[held]) / np.sqrt(count[held])
    return float(excess.max())


def _most_evident(found: list[Calibration], question: Question) -> Calibration:
    """Of nearly equal ones the one that claims least knowledge, with the widest uncertainty."""
    judged = [(log_evidence(calibration, question), calibration) for calibration in found]
    best = max(evidence for evidence, _ in judged)
    near = [pair for pair in judged if pair[0] > best - UNDECIDED]
    return max(near, key=lambda pair: (pair[1].hypothesis.free.size, pair[0]))[1]
