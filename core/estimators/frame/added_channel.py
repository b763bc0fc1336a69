"""Errors of the force and of the modes as one more accelerometer would leave them, before there is one.

The parameters stay as calibrated, and the new channel shows what the others predict of it. The covariance of the
parameters, and that of the linear estimate, depend on the model, the noise and the motion of the base slab alone, so
that no record of the new channel is needed.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.errors import IdentificationError
from core.estimators.frame.calibration import Calibration, expected
from core.estimators.frame.estimator import CALIBRATED, free_vibration_bound
from core.estimators.frame.evaluation import Hypothesis, Problem
from core.estimators.frame.hypotheses import Choice, best_hypothesis
from core.estimators.frame.lines import Lines, spectral_lines, within
from core.estimators.frame.model import Design, Layout
from core.estimators.frame.reconstruction import channel_covariance
from core.estimators.frame.uncertainty import reconstructed
from core.estimators.superstructure import InstrumentedSuperstructure, check


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Standard deviations with one set of channels."""

    force: float
    """N, root mean square over the record, by noise and by what the record leaves open."""
    frequency: Vector
    """(modes,) of each frequency's logarithm."""
    damping: Vector
    """(modes,) of each damping ratio's logarithm."""


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """Errors as they are, and with one more channel at each floor that has none."""

    now: Errors
    frequency: Vector
    """(modes,) Hz."""
    added: tuple[tuple[int, Errors], ...]
    """By floor, 0 for the lowest above the base slab."""


def gains(superstructure: InstrumentedSuperstructure) -> Gains:
    """By how much one more accelerometer at each floor would narrow the force and the modes.

    Args:
        superstructure: with its record.

    Raises:
        RecordError: the record cannot be used.
        IdentificationError: no superstructure can be calibrated from it.
    """
    check(superstructure)
    design = Design.of(superstructure.floor_mass, superstructure.storey_stiffness, superstructure.measured)
    lines = spectral_lines(superstructure)
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            choice = best_hypothesis(within(lines, CALIBRATED), design, free_vibration_bound(superstructure, lines))
    except (linalg.LinAlgError, FloatingPointError) as error:
        raise IdentificationError(f"no superstructure can be calibrated from the record: {error}") from None
    bands = choice.lines.band
    whole = replace(lines, noise=choice.lines.noise, band=np.clip(lines.band, bands.min(), bands.max()))
    free = [floor for floor in range(design.layout.floors) if floor not in superstructure.measured]
    return Gains(
        _errors(whole, design, choice.calibration, superstructure.base_mass),
        choice.calibration.structure.frequencies,
        tuple((floor, _with(whole, design, choice, superstructure.base_mass, floor)) for floor in free),
    )


def _with(whole: Lines, design: Design, choice: Choice, base_mass: float, floor: int) -> Errors:
    wider = replace(design, measured=np.append(design.measured, floor))
    calibration = choice.calibration
    given = calibration.hypothesis
    parameters, mean, std = (
        _widened(one, design.layout, wider.layout) for one in (calibration.parameters, given.mean, given.std)
    )
    hypothesis = Hypothesis(given.name, mean, std, given.is_random)
    start = replace(calibration, parameters=parameters, hypothesis=hypothesis)
    seen = replace(choice.lines, noise=calibration.noise)  # as its own covariance was computed
    problem = Problem(_predicted(seen, wider, start), wider, hypothesis)
    after = replace(
        expected(problem, parameters, calibration.variances),
        misfit_by_band=calibration.misfit_by_band,
        degrees_of_freedom=calibration.degrees_of_freedom,
    )
    return _errors(_predicted(whole, wider, start), wider, after, base_mass)


def _widened(values: Vector, narrow: Layout, wide: Layout) -> Vector:
    """Values of parameters with those of one more channel, which are the middle of the others'."""
    made = np.zeros(wide.size)
    made[: narrow.gains.start] = values[: narrow.gains.start]
    for old, new in ((narrow.gains, wide.gains), (narrow.delays, wide.delays)):
        made[new] = np.append(values[old], np.median(values[old]))
    made[wide.transients] = values[narrow.transients]
    return made


def _predicted(lines: Lines, wider: Design, calibration: Calibration) -> Lines:
    """The lines with one more channel: what the others predict of it, with a noise in the middle of theirs."""
    noise = np.append(lines.noise, np.median(lines.noise))
    blank = replace(lines, spectra=np.vstack([lines.spectra, lines.spectra[:1]]), noise=noise)
    covariance = channel_covariance(blank, wider, calibration)
    weights = np.linalg.solve(covariance[:, :-1, :-1], lines.spectra.T[:, :, None])[:, :, 0]
    last = np.einsum("lc,lc->l", covariance[:, -1, :-1], weights)
    return replace(blank, spectra=np.vstack([lines.spectra, last]))


def _errors(lines: Lines, design: Design, calibration: Calibration, base_mass: float) -> Errors:
    found = reconstructed(lines, design, calibration, base_mass)
    structure = calibration.structure
    of_squared, _, of_ratios = structure.changes
    count = design.layout.structural
    own = calibration.covariance[:count, :count] * max(1.0, calibration.chi_square)

    def deviations(changes: Matrix) -> Vector:
        return np.asarray(np.sqrt(np.einsum("pm,pq,qm->m", changes, own, changes)))

    return Errors(
        float(np.sqrt(np.mean(found.noise_std**2))),
        deviations(of_squared / structure.squared / 2),
        deviations(of_ratios / structure.damping_ratios),
    )
