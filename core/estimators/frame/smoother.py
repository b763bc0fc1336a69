"""An estimator that tells all floors together from those measured, by a superstructure calibrated from the record."""

from dataclasses import replace

import numpy as np
from scipy import linalg

from core.building import FixedBaseModes
from core.estimators import cms
from core.estimators.estimator import InstrumentedSuperstructure, RestoringForce, check
from core.estimators.frame.all_floors import smoothed
from core.estimators.frame.calibrated_storeys import storey_stiffness
from core.estimators.frame.hypotheses import Choice, chosen
from core.estimators.frame.left_out import left_out
from core.estimators.frame.mixture import rival_errors
from core.estimators.frame.shape_error import local_mean_square
from core.estimators.frame.spectral_lines import Lines, spectral_lines, within
from core.estimators.frame.superstructure_model import Design, Layout
from core.estimators.reliance import Reliance
from core.estimators.storeys import StoreyStiffness
from core.identification.identified_modes import Identification

NAME = "smoother"
CALIBRATED = (0.2, 20.0)
"""Hz, of the lines that the superstructure is calibrated by."""
ALL_MEASURED = "nothing: every floor is measured"
RINGING = 3.0
"""Of the floors' root mean square: how large the free vibration at the record's ends may be."""


def estimate(superstructure: InstrumentedSuperstructure) -> RestoringForce:
    """Restoring force F = -Σ m_i a_i, every level's acceleration estimated from all that were measured.

    The superstructure is a frame on a rocking base whose stiffness and damping are calibrated from the record, with
    noise allowed for in every channel. Where the record asks for it, the distribution of the floors' mass and the
    sensors' gains and clocks are corrected; where noise does not explain what is left, motion that the model does not
    know is estimated too, and measured floors stay as measured. `reliance` says what was assumed. If the calibrated
    superstructure tells measured floors worse than static interpolation does, the paper's estimate stands in.

    Raises:
        RecordError: the record holds gaps, is shorter than 10 s, or does not fit the floors it is said to be from.
        ModelError: a mass is not positive, or a floor is measured that the building does not have.
    """
    check(superstructure)
    design = Design.of(superstructure.floor_mass, superstructure.storey_stiffness, superstructure.measured)
    lines = spectral_lines(superstructure)
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):  # as a channel of zeros, without noise, does
            choice = chosen(within(lines, CALIBRATED), design, ringing(superstructure, lines))
    except (linalg.LinAlgError, FloatingPointError) as error:
        return _fallen_back(superstructure, lines, f"the calibration broke down ({error})")
    reliance = _reliance(choice, design.layout)
    if choice.calibration.hypothesis.is_random and superstructure.measured.size == superstructure.floor_mass.size:
        return replace(
            cms.estimate(superstructure),
            reliance=replace(reliance, assumption=ALL_MEASURED, chi_square=None),
            superstructure=_modes(choice),
            storeys=_storeys(superstructure, design, choice),
        )
    beside = left_out(choice.lines, design, choice.calibration)
    if beside.model > beside.static:
        errors = f"{beside.model:.2g} by the model, of {beside.static:.2g} by interpolation"
        return _fallen_back(superstructure, lines, f"left-out floors are told with an error of {errors}", reliance)
    return _force(superstructure, lines, design, choice, reliance, beside.share)


def _force(
    superstructure: InstrumentedSuperstructure,
    lines: Lines,
    design: Design,
    choice: Choice,
    reliance: Reliance,
    share: float | None,
) -> RestoringForce:
    bands = choice.lines.band
    whole = replace(lines, noise=choice.lines.noise, band=np.clip(lines.band, bands.min(), bands.max()))
    found = smoothed(whole, design, choice.calibration, superstructure.base_mass, share)
    rivals = rival_errors(whole, design, choice, superstructure.base_mass, found)
    return RestoringForce(
        estimator=NAME,
        force=found.force,
        rigid=found.rigid,
        modal=found.force - found.rigid,
        std=np.sqrt(found.std**2 + local_mean_square(rivals, whole.rate)),
        modes=cms.fixed_base_modes(superstructure, Identification()),
        error=found.error,
        noise_std=found.noise_std,
        systematic=np.vstack([found.systematic, rivals]),
        reliance=reliance,
        superstructure=_modes(choice),
        storeys=_storeys(superstructure, design, choice),
    )


def _modes(choice: Choice) -> FixedBaseModes:
    structure = choice.calibration.structure
    return FixedBaseModes(np.sqrt(structure.squared), structure.damping_ratios, structure.shapes)


def _storeys(superstructure: InstrumentedSuperstructure, design: Design, choice: Choice) -> StoreyStiffness | None:
    told = superstructure.storey_stiffness
    return None if told is None else storey_stiffness(choice.calibration, design, told)


def _fallen_back(
    superstructure: InstrumentedSuperstructure, lines: Lines, reason: str, reliance: Reliance | None = None
) -> RestoringForce:
    judged = reliance or Reliance("no superstructure was found", None, lines.at_rest, 1.0)
    return replace(cms.estimate(superstructure), reliance=replace(judged, fallback=reason))


def _reliance(choice: Choice, layout: Layout) -> Reliance:
    calibration = choice.calibration
    prior = calibration.hypothesis.std[layout.storeys]
    variance = np.diag(calibration.covariance)[layout.storeys]
    left = variance[prior > 0] / prior[prior > 0] ** 2
    return Reliance(
        assumption=calibration.hypothesis.name,
        chi_square=choice.chi_square,
        is_at_rest=choice.lines.at_rest,
        prior_share=float(np.mean(left)) if left.size else 0.0,
    )


def ringing(superstructure: InstrumentedSuperstructure, lines: Lines) -> float:
    """m/s² kg^½, how large the modes' free vibration at the record's ends may be; 0 if it begins and ends at rest."""
    if lines.at_rest:
        return 0.0
    return RINGING * float(np.std(superstructure.floor_acceleration) * np.sqrt(superstructure.floor_mass.sum()))
