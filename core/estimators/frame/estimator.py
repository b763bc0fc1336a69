"""The frame estimator: all floors from those measured, by a superstructure calibrated from the record."""

from dataclasses import replace

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.building import FixedBaseModes
from core.estimators import cms
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.hypotheses import Choice, best_hypothesis
from core.estimators.frame.lines import Lines, spectral_lines, within
from core.estimators.frame.model import Design, Layout
from core.estimators.frame.shape_error import left_out, local_mean_square
from core.estimators.frame.uncertainty import reconstructed, rival_errors
from core.estimators.result import Assessment, RestoringForce, StoreyStiffness
from core.estimators.superstructure import InstrumentedSuperstructure, check
from core.identification.identified_modes import Identification

NAME = "smoother"
"""Name of the estimator in stored results."""
CALIBRATED = (0.2, 20.0)
"""Hz, of the lines that the superstructure is calibrated by. A choice."""
ALL_MEASURED = "masses as given, every floor measured"
"""Assumption of an estimate that needs no model of the superstructure, in words."""
FREE_VIBRATION_BOUND = 3.0
"""Standard deviation of the free vibration at the record's ends over the floors' root mean square. A choice."""


def estimate(superstructure: InstrumentedSuperstructure) -> RestoringForce:
    """Restoring force F = -Σ m_i a_i, every level's acceleration estimated from all that were measured.

    The superstructure is a frame on a rocking base whose stiffness and damping are calibrated from the record, with
    noise allowed for in every channel. If the record supports it, the distribution of the floors' mass and the
    sensors' gains and clocks are corrected; where noise does not explain the residual, unmodelled motion is estimated
    too, and measured floors stay as measured. `assessment` names the assumptions. If the calibrated superstructure
    predicts left-out floors worse than static interpolation does, the paper's estimate replaces it.

    Raises:
        RecordError: the record holds gaps, is shorter than 10 s, or its shape does not fit the measured floors.
        ModelError: a mass is not positive, or a floor is measured that the building does not have.
    """
    check(superstructure)
    design = Design.of(superstructure.floor_mass, superstructure.storey_stiffness, superstructure.measured)
    lines = spectral_lines(superstructure)
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):  # as a channel of zeros, without noise, does
            choice = best_hypothesis(within(lines, CALIBRATED), design, free_vibration_bound(superstructure, lines))
    except (linalg.LinAlgError, FloatingPointError) as error:
        return _fallback(superstructure, lines, f"the calibration broke down ({error})")
    assessment = _assessment(choice, design.layout)
    if choice.calibration.hypothesis.is_random and superstructure.measured.size == superstructure.floor_mass.size:
        return replace(
            cms.estimate(superstructure),
            assessment=replace(assessment, assumption=ALL_MEASURED, chi_square=None),
            superstructure=_modes(choice),
            storeys=_storeys(superstructure, design, choice),
        )
    beside = left_out(choice.lines, design, choice.calibration)
    if beside.model > beside.static:
        errors = f"{beside.model:.2g} by the model, of {beside.static:.2g} by interpolation"
        return _fallback(superstructure, lines, f"left-out floors are predicted with an error of {errors}", assessment)
    return _force(superstructure, lines, design, choice, assessment, beside.share)


def _force(
    superstructure: InstrumentedSuperstructure,
    lines: Lines,
    design: Design,
    choice: Choice,
    assessment: Assessment,
    share: float | None,
) -> RestoringForce:
    bands = choice.lines.band
    whole = replace(lines, noise=choice.lines.noise, band=np.clip(lines.band, bands.min(), bands.max()))
    reconstruction = reconstructed(whole, design, choice.calibration, superstructure.base_mass, share)
    rivals = rival_errors(whole, design, choice, superstructure.base_mass, reconstruction)
    return RestoringForce(
        estimator=NAME,
        force=reconstruction.force,
        rigid=reconstruction.rigid,
        modal=reconstruction.force - reconstruction.rigid,
        std=np.sqrt(reconstruction.std**2 + local_mean_square(rivals, whole.rate)),
        modes=cms.fixed_base_modes(superstructure, Identification()),
        error=reconstruction.error,
        noise_std=reconstruction.noise_std,
        systematic=np.vstack([reconstruction.systematic, rivals]),
        assessment=assessment,
        superstructure=_modes(choice),
        storeys=_storeys(superstructure, design, choice),
    )


def _modes(choice: Choice) -> FixedBaseModes:
    structure = choice.calibration.structure
    return FixedBaseModes(np.sqrt(structure.squared), structure.damping_ratios, structure.shapes)


def _storeys(superstructure: InstrumentedSuperstructure, design: Design, choice: Choice) -> StoreyStiffness | None:
    nominal, given = superstructure.storey_stiffness, choice.masses_as_given
    if nominal is None:
        return None
    return replace(
        storey_stiffness(choice.calibration, design, nominal),
        with_given_masses=None if given is None else storey_stiffness(given, design, nominal),
        evidence_of_masses=choice.evidence_of_masses,
    )


def _fallback(
    superstructure: InstrumentedSuperstructure, lines: Lines, reason: str, assessment: Assessment | None = None
) -> RestoringForce:
    judged = assessment or Assessment("no superstructure was found", None, lines.at_rest, 1.0)
    return replace(cms.estimate(superstructure), assessment=replace(judged, fallback=reason))


def _assessment(choice: Choice, layout: Layout) -> Assessment:
    calibration = choice.calibration
    prior = calibration.hypothesis.std[layout.storeys]
    variance = np.diag(calibration.covariance)[layout.storeys]
    left = variance[prior > 0] / prior[prior > 0] ** 2
    return Assessment(
        assumption=calibration.hypothesis.name,
        chi_square=choice.chi_square,
        is_at_rest=choice.lines.at_rest,
        prior_share=float(np.mean(left)) if left.size else 0.0,
    )


def free_vibration_bound(superstructure: InstrumentedSuperstructure, lines: Lines) -> float:
    """m/s² kg^½, prior standard deviation of the modes' free vibration at the record's ends; 0 if these are at rest."""
    if lines.at_rest:
        return 0.0
    motion = np.std(superstructure.floor_acceleration) * np.sqrt(superstructure.floor_mass.sum())
    return FREE_VIBRATION_BOUND * float(motion)


def storey_stiffness(calibration: Calibration, design: Design, nominal: Vector) -> StoreyStiffness:
    """Stiffness of every storey by a calibration.

    Args:
        calibration: of the superstructure.
        design: that it was calibrated with.
        nominal: (floors,) N/m, as the building file gives it; the design is in proportion to it.
    """
    to_storeys = _to_storeys(design.layout)
    scale = np.log(design.storey_stiffness / nominal)
    return StoreyStiffness(
        np.asarray(scale + to_storeys @ calibration.parameters),
        np.asarray(to_storeys @ calibration.covariance @ to_storeys.T),
        np.asarray((to_storeys * calibration.hypothesis.std**2) @ to_storeys.T),
    )


def _to_storeys(layout: Layout) -> Matrix:
    """(floors, size) the logarithms of the storeys' stiffnesses by the parameters."""
    rows = np.zeros((layout.floors, layout.size))
    rows[:, layout.scale] = 1.0
    rows[:, layout.storeys] = np.tril(np.ones((layout.floors, layout.floors)))
    return rows
