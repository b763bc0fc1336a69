"""Assessment of a model by its errors in later events. Pure: errors in, assessment out.

An event is missed where what the noise does not explain of the error is more than the model was used to, in any
direction: beyond SPARE times the largest such share in the events that its values were fitted to, beyond LEAST, and the
whole noise ratio beyond ABOVE_FLOOR. One event may be strange; the model has stopped being good when the latest
IN_A_ROW are missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import sqrt

from core.comparison.misfit import Misfit
from core.record import Finding
from service.models import texts

SPARE = 1.5
"""Factor on the largest error of the fitted events, up to which a model does not miss an event. A choice."""
LEAST = 0.02
"""Share of the force's RMS: smaller errors cannot be distinguished from the estimate's own."""
ABOVE_FLOOR = 1.25
"""Noise ratio up to which an error may be noise. A choice."""
IN_A_ROW = 2
"""Latest events that a model must miss before it is said. A choice: one may have a fault of its own."""


@dataclass(frozen=True, slots=True)
class EventError:
    """Error of a model in one event and direction."""

    number: int
    """Number of the event."""
    start: datetime
    direction: str
    is_fitted: bool
    """True if the model's values were fitted to it."""
    misfit: Misfit
    """N."""


@dataclass(frozen=True, slots=True)
class RatedError:
    """The same, rated by the errors that the model is used to."""

    event: EventError
    excess: float
    """Error beyond noise, as a share of the force's RMS."""
    allowed: float | None
    """The most that is not missed; None as long as nothing was fitted."""

    @property
    def is_missed(self) -> bool:
        """True if the model's error here is larger than usual."""
        beyond = self.allowed is not None and self.excess > self.allowed
        return beyond and not self.event.is_fitted and self.event.misfit.noise_ratio > ABOVE_FLOOR


def excess(misfit: Misfit) -> float:
    """Error beyond noise, as a share of the force's RMS."""
    return sqrt(max(misfit.error - misfit.noise, 0.0) / misfit.signal) if misfit.signal > 0 else 0.0


def rated(errors: Sequence[EventError]) -> tuple[RatedError, ...]:
    """Errors of one version of a model in every event, in the order given."""
    used_to = [excess(one.misfit) for one in errors if one.is_fitted]
    allowed = max(SPARE * max(used_to), LEAST) if used_to else None
    return tuple(RatedError(one, excess(one.misfit), allowed) for one in errors)


def finding(trend: Sequence[RatedError]) -> Finding | None:
    """Finding on the latest events after those that were fitted; None where the model is good, or nothing was fitted.

    Args:
        trend: the earliest event first.
    """
    later: dict[int, list[RatedError]] = {}
    fitted_until = max((one.event.start for one in trend if one.event.is_fitted), default=None)
    for one in trend:
        if not one.event.is_fitted and (fitted_until is None or one.event.start > fitted_until):
            later.setdefault(one.event.number, []).append(one)
    latest = [_worst(directions) for directions in later.values()][-IN_A_ROW:]
    if not latest or not latest[-1].is_missed:
        return None
    stopped = len(latest) == IN_A_ROW and all(one.is_missed for one in latest)
    last = latest[-1]
    message = texts.missed(
        IN_A_ROW if stopped else 1, last.event.start, last.event.direction, last.excess, last.allowed
    )
    return Finding("model", "warning" if stopped else "note", message, value=last.excess)


def _worst(directions: Sequence[RatedError]) -> RatedError:
    """The direction that decides: an event is missed if it is missed in any direction."""
    return max(directions, key=lambda one: (one.is_missed, one.excess))
