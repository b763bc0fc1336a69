"""The finding that the isolators exceeded a limit of inspection or action; only a recorded inspection ends it."""

from collections.abc import Iterator
from math import sqrt
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from core.description import IsolationLayer
from service.alerts.candidates import Found
from service.alerts.words import LIMITS, of_time
from service.analyses import history
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.records.tables import Event
from service.verdict import reading, words
from service.verdict.assessment import motion_checks
from service.verdict.checks import Check, Level, Measured, gravest
from service.verdict.limits import RESIDUAL, first_to_inspect

DIRECTIONS = 2
"""A displacement in plan is at most the square root of so many times that in one direction."""


def limit_findings(session: Session, building_id: int) -> tuple[Found, ...]:
    """One finding where an earthquake since the last inspection exceeded such a limit, with all that did; else none."""
    building = session.get_one(Building, building_id)
    file = building_store.described(session, building)
    over = list(_exceedances(session, building_id, file.description.isolation))
    if not over:
        return ()
    gravest_event, checks, displacement = max(over, key=lambda one: (one[1][0].level.rank, _size(one[2])))
    first, last = over[0][0], over[-1][0]
    level = checks[0].level
    when = of_time(gravest_event.start.astimezone(ZoneInfo(file.timezone)))
    return (
        Found(
            cause=LIMITS,
            kind="limit",
            is_sure=True,
            began_at=first.start,
            raised_at=last.start,
            onset_event_id=first.id,
            raised_event_id=last.id,
            event_ids=tuple(event.id for event, _, _ in over),
            evidence={"level": str(level), "checks": [check.name for check in checks], **_interval(displacement)},
            summary=f"{words.title(checks[0])}: {words.brief(checks[0])}, beyond the limit of {_kind(level)}",
            sentences=(
                f"This was in the earthquake of {when}. The alert stays until an inspection is recorded on its page.",
                words.MEANINGS[level],
                *(f"{words.of_limit(check)}." for check in checks),
            ),
        ),
    )


def _exceedances(
    session: Session, building_id: int, layer: IsolationLayer
) -> Iterator[tuple[Event, tuple[Check, ...], Measured | None]]:
    """Each earthquake with the checks that exceeded a limit of inspection or action, the gravest first."""
    far = first_to_inspect(layer)
    found = history.moved_far(
        session,
        building_id,
        since=history.last_inspection(session, building_id, LIMITS),
        displacement=float("inf") if far is None else far / sqrt(DIRECTIONS),
        residual=(RESIDUAL.inspect or RESIDUAL.watch) / sqrt(DIRECTIONS),
    )
    for event, analysis in found:
        displacement, residual = reading.motion(session, analysis)
        checks = [one for one in motion_checks(layer, displacement, residual) if _is_over(one)]
        if checks:
            ordered = tuple(sorted(checks, key=lambda one: -one.level.rank))
            yield event, ordered, displacement if isinstance(displacement, Measured) else None


def _is_over(check: Check) -> bool:
    """Whether its level is that of an inspection or an action."""
    return gravest((check.level, Level.INSPECT)) is check.level


def _interval(displacement: Measured | None) -> dict[str, float]:
    """m, by which the alert is told when it gets worse: the largest displacement and its 95 % interval."""
    if displacement is None or displacement.uncertainty is None:
        return {}
    value, u = displacement.value, displacement.uncertainty
    return {"drift": value, "low": value - u, "high": value + u}


def _size(displacement: Measured | None) -> float:
    return 0.0 if displacement is None else displacement.value


def _kind(level: Level) -> str:
    return "action" if level is Level.ACT else "inspection"
