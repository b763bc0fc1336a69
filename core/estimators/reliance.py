"""How far may an estimate be relied on?"""

from dataclasses import dataclass

from core.quality import Finding
from core.record import Direction

EXPLAINED = 2.0
"""Chi-square per degree of freedom above which an engineer should know that the model is not the building."""


@dataclass(frozen=True, slots=True)
class Reliance:
    """How far an estimator's assumptions hold on a record."""

    assumption: str
    """What the record asked to be assumed of superstructure and sensors, in words."""
    chi_square: float | None
    """Per degree of freedom, of a superstructure whose misfit is noise alone: about 1 where that explains all; None
    where no superstructure was needed or found."""
    is_at_rest: bool
    """Whether the record begins and ends at rest; else the modes' free vibration at its ends was estimated too."""
    prior_share: float
    """Of what is known of the storeys' stiffness: 0 if all is from the record, 1 if all was believed before."""
    fallback: str | None = None
    """Why the force is another estimator's; None if it is its own."""


def reliance_findings(reliance: Reliance | None, direction: Direction) -> tuple[Finding, ...]:
    """What an engineer should know of an estimate in one direction: nothing where its assumptions hold."""
    if reliance is None:
        return ()
    if reliance.fallback is not None:
        message = (
            f"direction {direction}: the calibrated superstructure was not used: {reliance.fallback}; the force is the "
            "paper's, with static interpolation between measured floors. A sensor on another floor would do"
        )
        return (Finding("estimator", "warning", message, value=reliance.chi_square),)
    if reliance.chi_square is not None and reliance.chi_square > EXPLAINED:
        message = (
            f"direction {direction}: noise alone does not explain what the superstructure leaves of the record "
            f"(chi-square {reliance.chi_square:.3g}); assumed: {reliance.assumption}; measured floors stay as "
            "measured, and the force's standard deviation allows for it"
        )
        return (Finding("estimator", "note", message, value=reliance.chi_square),)
    return ()
