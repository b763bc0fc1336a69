"""What is known of a building's drift, as the API answers it."""

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

from sqlalchemy.orm import Session

from core.drift.quantities import QUANTITIES
from service.drift import baseline_json, queries
from service.drift.curve import Curve, curve
from service.drift.schema import BaselineOut, CurvePoint, DriftAlarmRow, ObservationRow, SeriesRow
from service.drift.series import watched_series
from service.drift.tables import DriftAlarm, WatchedSeries
from service.errors import NotFoundError


def series_rows(session: Session, building_id: int) -> list[SeriesRow]:
    """Everything that is watched at a building."""
    counts, latest = queries.counts(session, building_id), queries.latest_values(session, building_id)
    return [
        SeriesRow(
            quantity=series.quantity,
            subject=series.subject,
            title=QUANTITIES[series.quantity].title,
            events=counts.get(series.id, 0),
            wanted=series.wanted,
            latest_event=None if last is None else last.event_id,
            latest_value=None if last is None else last.value,
            latest_std=None if last is None else last.std,
            alarms=sum(alarm.is_sure for alarm in series.alarms),
            monitored_at=series.created_at,
        )
        for series in queries.every_series(session, building_id)
        for last in [latest.get(series.id)]
    ]


def baseline(code: str, series: WatchedSeries, temperature: float | None, points: int) -> BaselineOut:
    """What is expected of a series; without a curve as long as that is nothing.

    Args:
        code: of the building.
        series: as it was monitored last.
        temperature: °C; None: the mean of the reference.
        points: amplitudes of the curve.
    """
    known = None if series.baseline is None else baseline_json.read(series.baseline)
    drawn = None if known is None else curve(known, temperature, points)
    lowest, highest = (None, None) if known is None or known.range is None else known.range
    return BaselineOut(
        building=code,
        quantity=series.quantity,
        subject=series.subject,
        temperature=None if drawn is None else drawn.temperature,
        lowest_amplitude=lowest,
        highest_amplitude=highest,
        reference_events=[] if known is None else list(known.events),
        wanted=series.wanted,
        items=[] if drawn is None else _curve_points(drawn),
        next=None,
    )


def observations(
    session: Session, building_id: int, quantity: str, subject: str, event: int | None
) -> list[ObservationRow]:
    """What a series was observed to be, in order of time.

    Raises:
        NotFoundError: nothing of that name is observed at the building.
    """
    for series in watched_series(session, building_id, (quantity,)):
        if series.subject == subject:
            wanted = [one for one in series.measurements if event is None or one.event == event]
            return [ObservationRow.model_validate(one) for one in sorted(wanted, key=attrgetter("time", "event"))]
    raise NotFoundError("watched series", f"{quantity}/{subject}")


def alarm_rows(session: Session, building_id: int) -> list[DriftAlarmRow]:
    """What the rules found at a building."""
    return [_alarm_row(alarm) for alarm in queries.alarms(session, building_id)]


def cells(rows: Sequence[Any]) -> list[tuple[Any, ...]]:
    """The rows of a table."""
    return [tuple(dict(row).values()) for row in rows]


def _alarm_row(alarm: DriftAlarm) -> DriftAlarmRow:
    return DriftAlarmRow(
        quantity=alarm.series.quantity,
        subject=alarm.series.subject,
        rule=alarm.rule,
        is_sure=alarm.is_sure,
        onset_event=alarm.onset_event_id,
        onset_start=alarm.onset.start,
        after_event=alarm.after_event_id,
        changed_after=None if alarm.after is None else alarm.after.start,
        by_event=alarm.by_event_id,
        changed_by=None if alarm.by is None else alarm.by.start,
        raised_event=alarm.raised_event_id,
        raised_start=alarm.raised.start,
        events=alarm.event_ids,
        drift=alarm.drift,
        low=alarm.low,
        high=alarm.high,
        false_alarms=alarm.false_alarms,
        causes=alarm.causes,
        message=alarm.message,
    )


def _curve_points(drawn: Curve) -> list[CurvePoint]:
    return [
        CurvePoint(
            amplitude=None if drawn.amplitude is None else float(drawn.amplitude[n]),
            expected=float(drawn.expected[n]),
            low=float(drawn.low[n]),
            high=float(drawn.high[n]),
            is_seen=bool(drawn.is_seen[n]),
        )
        for n in range(drawn.expected.size)
    ]
