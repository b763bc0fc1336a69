"""What do the alarms of all series say that people should know now?

A series tells one thing: of what the rules found in it one after the other, the last that is sure, and before any is,
what gathers. A loss in the building stays told whatever follows, for only an inspection ends it; that it went back is
told besides. A sensor or a model that does as before needs telling no more.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from typing import Any
from zoneinfo import ZoneInfo

from core.drift.alarms import Alarm
from core.drift.explanations import explanations, shifts
from core.drift.monitor import Monitoring
from core.drift.quantities import LAYER_QUANTITIES
from core.drift.rules import RECOVERY
from service.alerts.candidates import Found, Kind
from service.alerts.words import RECOVERED
from service.drift.words import dated, sentences, summary

KINDS: Mapping[str, Kind] = {"gain": "sensor", "noise": "sensor", "model_error": "model"}
"""By quantity; every other one is of the building itself."""
EXPLAINED = (*LAYER_QUANTITIES, "frequency")
"""Quantities of which a wrong mass, or a wrong gain, moves several at once."""


def findings(
    monitorings: Sequence[tuple[Monitoring, tuple[str, ...]]], starts: Mapping[int, datetime], zone: ZoneInfo
) -> tuple[Found, ...]:
    """At most one of a cause.

    Args:
        monitorings: of every series, with the channels that it is measured with.
        starts: of the events, aware.
        zone: of the building, for times that people read.
    """
    every = [monitoring for monitoring, _ in monitorings]
    return tuple(
        _found(name, kind, monitoring, number, channels, every, starts, zone)
        for monitoring, channels in monitorings
        for name, kind, number in _told(monitoring)
    )


def _told(monitoring: Monitoring) -> Iterator[tuple[str, Kind, int]]:
    """Cause, kind and place among the alarms of what is to be told of a series."""
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
    """The last that is sure, else the last."""
    return next((n for n in reversed(among) if alarms[n].is_sure), among[-1])


def _found(
    cause: str,
    kind: Kind,
    monitoring: Monitoring,
    number: int,
    channels: tuple[str, ...],
    every: Sequence[Monitoring],
    starts: Mapping[int, datetime],
    zone: ZoneInfo,
) -> Found:
    alarm, series = monitoring.alarms[number], monitoring.series
    began = starts[alarm.onset]
    told = explanations(shifts(every, began)) if series.quantity in EXPLAINED else ()
    earlier = tuple(one for one in monitoring.alarms[:number] if one.is_sure)
    return Found(
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
        evidence={**_evidence(alarm), "explanations": [asdict(one) for one in told]},
        summary=summary(series.quantity, series.subject, alarm),
        sentences=sentences(series.quantity, alarm, earlier, told),
        dated=dated(alarm, starts[alarm.after].astimezone(zone), starts[alarm.by].astimezone(zone)),
    )


def _evidence(alarm: Alarm) -> dict[str, Any]:
    """What JSON holds of it."""
    return {
        "rule": alarm.rule,
        "drift": alarm.drift,
        "low": alarm.low,
        "high": alarm.high,
        "false_alarms": alarm.false_alarms,
        "causes": list(alarm.causes),
        "message": alarm.message,
    }
