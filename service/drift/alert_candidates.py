"""Alert candidates from the monitored series, and from limits that the isolators exceeded.

A series gives one candidate: the last change that is sure, or the last one while none is. A loss in the building
remains whatever follows, since only an inspection ends it; a return to earlier values is a second candidate. A sensor
or a model that has returned gives none.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from math import sqrt
from typing import Any
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from core.drift.alarms import Alarm
from core.drift.explanations import explanations, shifts
from core.drift.monitor import Monitoring
from core.drift.quantities import LAYER_QUANTITIES
from core.drift.rules import RECOVERY
from service.alerts.candidates import AlertCandidate, Kind
from service.alerts.texts import LIMITS, RECOVERED, local_time
from service.analyses import history
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.drift import texts
from service.records.tables import Event
from service.verdict import accumulated, reading, texts as verdict_texts
from service.verdict.checks import Check, Lacking, Level, Limits, Measured, Outcome, gravest
from service.verdict.limits import (
    RESIDUAL_OFFSET,
    accumulated_checks,
    first_to_inspect,
    level_limit,
    limits_of,
    motion_checks,
)
from service.verdict.shaking import first_to_inspect_shaking, shaking_checks

KINDS: Mapping[str, Kind] = {"gain": "sensor", "noise": "sensor", "model_error": "model"}
"""By quantity; every other one is of the building itself."""
EXPLAINED = (*LAYER_QUANTITIES, "frequency")
"""Quantities of which a wrong mass, or a wrong gain, moves several at once."""
DIRECTIONS = 2
"""A displacement in plan is at most the square root of this number times that in one direction."""


def drift_candidates(
    monitorings: Sequence[tuple[Monitoring, tuple[str, ...]]], starts: Mapping[int, datetime], zone: ZoneInfo
) -> tuple[AlertCandidate, ...]:
    """At most one candidate per cause.

    Args:
        monitorings: of every series, with the channels that it is measured with.
        starts: of the events, aware.
        zone: of the building, for times in sentences.
    """
    every = [monitoring for monitoring, _ in monitorings]
    return tuple(
        _drift_candidate(cause, kind, monitoring, number, channels, every, starts, zone)
        for monitoring, channels in monitorings
        for cause, kind, number in _reported_alarms(monitoring)
    )


def limit_candidates(session: Session, building_id: int) -> tuple[AlertCandidate, ...]:
    """One candidate for all earthquakes since the last inspection that exceeded an inspection or action limit."""
    building = session.get_one(Building, building_id)
    file = building_store.described(session, building)
    over = list(_exceedances(session, building_id, file))
    if not over:
        return ()
    gravest_event, checks, displacement = max(over, key=lambda one: (one[1][0].level.rank, _size(one[2])))
    first, last = over[0][0], over[-1][0]
    level = checks[0].level
    return (
        AlertCandidate(
            cause=LIMITS,
            kind="limit",
            is_sure=True,
            began_at=first.start,
            raised_at=last.start,
            onset_event_id=first.id,
            raised_event_id=last.id,
            event_ids=tuple(event.id for event, _, _ in over),
            evidence={
                "event": gravest_event.id,
                "level": str(level),
                "checks": [check.name for check in checks],
                **_interval(displacement),
            },
            summary=_limit_summary(checks[0]),
            sentences=(
                texts.LIMIT_EVENT.format(when=local_time(gravest_event.start.astimezone(ZoneInfo(file.timezone)))),
                verdict_texts.MEANINGS[level],
                *(
                    " ".join(one for one in (f"{verdict_texts.of_limit(check)}.", check.reason) if one)
                    for check in checks
                ),
            ),
        ),
    )


def _limit_summary(check: Check) -> str:
    """One line about the gravest check: what is exceeded, or that only the action limit is unclear."""
    is_exceeded = check.outcome is Outcome.EXCEEDED and verdict_texts.level_of_limit(check) is check.level
    value = verdict_texts.brief(check) if is_exceeded else verdict_texts.value(check)
    beyond = texts.BEYOND_LIMIT[check.level] if is_exceeded else texts.LIMIT_UNCLEAR
    return f"{verdict_texts.title(check)}: {value}, {beyond}"


def _reported_alarms(monitoring: Monitoring) -> Iterator[tuple[str, Kind, int]]:
    """Cause, kind and index of the alarms of a series that give candidates."""
    quantity = monitoring.series.quantity
    cause, kind = f"{quantity}/{monitoring.series.subject}", KINDS.get(quantity, "deterioration")
    alarms = monitoring.alarms
    changes = [n for n, alarm in enumerate(alarms) if alarm.rule != RECOVERY]
    returns = [n for n, alarm in enumerate(alarms) if alarm.rule == RECOVERY]
    has_returned = bool(returns) and returns[-1] > max(changes, default=-1)
    if changes and not (has_returned and kind != "deterioration" and alarms[returns[-1]].is_sure):
        yield cause, kind, _surest(alarms, changes)
    if has_returned and kind == "deterioration":
        yield f"{RECOVERED}/{cause}", "recovery", _surest(alarms, returns)


def _surest(alarms: Sequence[Alarm], among: Sequence[int]) -> int:
    """The last that is sure; the last if none is."""
    return next((n for n in reversed(among) if alarms[n].is_sure), among[-1])


def _drift_candidate(
    cause: str,
    kind: Kind,
    monitoring: Monitoring,
    number: int,
    channels: tuple[str, ...],
    every: Sequence[Monitoring],
    starts: Mapping[int, datetime],
    zone: ZoneInfo,
) -> AlertCandidate:
    alarm, series = monitoring.alarms[number], monitoring.series
    began = starts[alarm.onset]
    compared = explanations(shifts(every, began)) if series.quantity in EXPLAINED else ()
    earlier = tuple(one for one in monitoring.alarms[:number] if one.is_sure)
    return AlertCandidate(
        cause=cause,
        kind=kind,
        is_sure=alarm.is_sure,
        began_at=began,
        raised_at=starts[alarm.raised],
        changed_after=starts[alarm.after],
        changed_by=starts[alarm.by],
        onset_event_id=alarm.onset,
        raised_event_id=alarm.raised,
        event_ids=alarm.events,
        channels=channels,
        evidence={**_evidence(alarm), "explanations": [asdict(one) for one in compared]},
        summary=texts.summary(series.quantity, series.subject, alarm),
        sentences=texts.sentences(series.quantity, alarm, earlier, compared),
        dated=texts.dated(alarm, starts[alarm.after].astimezone(zone), starts[alarm.by].astimezone(zone)),
    )


def _evidence(alarm: Alarm) -> dict[str, Any]:
    return {
        "rule": alarm.rule,
        "drift": alarm.drift,
        "low": alarm.low,
        "high": alarm.high,
        "false_alarms": alarm.false_alarms,
        "causes": list(alarm.causes),
        "message": alarm.message,
    }


def _exceedances(
    session: Session, building_id: int, file: BuildingFile
) -> Iterator[tuple[Event, tuple[Check, ...], Measured | None]]:
    """Each earthquake with the checks that exceeded an inspection or action limit, the gravest first."""
    layer = file.description.isolation
    limits = limits_of(layer, file.limits)
    far, left = first_to_inspect(layer, limits), level_limit(limits, RESIDUAL_OFFSET)
    added = _accumulated_beyond(session, building_id, limits)
    moved = history.moved_far(
        session,
        building_id,
        since=history.last_inspection(session, building_id, LIMITS),
        displacement=float("inf") if far is None else far / sqrt(DIRECTIONS),
        residual=float("inf") if left is None else left / sqrt(DIRECTIONS),
        shaking=first_to_inspect_shaking(limits, file.description),
        others=added,
    )
    for event, analysis in moved:
        displacement, residual = reading.motion(session, analysis)
        every = (
            *motion_checks(layer, limits, displacement, residual),
            *shaking_checks(reading.shaking_facts(session, analysis, file.description), limits),
            *added.get(event.id, ()),
        )
        checks = [one for one in every if _needs_inspection(one)]
        if checks:
            ordered = tuple(sorted(checks, key=lambda one: -one.level.rank))
            yield event, ordered, displacement if isinstance(displacement, Measured) else None


def _accumulated_beyond(
    session: Session, building_id: int, limits: Mapping[str, Limits | Lacking]
) -> Mapping[int, tuple[Check, ...]]:
    """Checks of what earthquakes add up to, by number of the event in which one first exceeded its limit.

    The sum of a later earthquake exceeds it again only if it had fallen below in between.
    """
    summed = accumulated.totals(session, [building_id])
    found: dict[int, tuple[Check, ...]] = {}
    before: set[str] = set()
    for event, _, sums in summed:
        checks = accumulated_checks(limits, accumulated.rest_position(sums), accumulated.travel(sums))
        beyond = tuple(one for one in checks if _needs_inspection(one))
        if any(one.name not in before for one in beyond):
            found[event] = beyond
        before = {one.name for one in beyond}
    return found


def _needs_inspection(check: Check) -> bool:
    return gravest((check.level, Level.INSPECT)) is check.level


def _interval(displacement: Measured | None) -> dict[str, float]:
    """m, largest displacement and its 95 % interval, by which an alert counts as worse."""
    if displacement is None or displacement.uncertainty is None:
        return {}
    value, u = displacement.value, displacement.uncertainty
    return {"drift": value, "low": value - u, "high": value + u}


def _size(displacement: Measured | None) -> float:
    return 0.0 if displacement is None else displacement.value
