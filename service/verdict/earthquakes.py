"""The assessments of many earthquakes of one building, by as many statements as a few take."""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import accumulate
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert
from service.analyses import history, queries as analysis_queries
from service.analyses.tables import Analysis, DirectionResult, LayerResult, ShakingResult
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db.select import Span
from service.drift.tables import DriftValue, MonitoredSeries
from service.jobs import queue as job_queue
from service.records import queries as record_queries
from service.records.tables import Event
from service.verdict.accumulated import totals
from service.verdict.assessment import Assessment, assess
from service.verdict.overview import StoredFacts
from service.verdict.reading import event_facts

WITHDRAWN = "withdrawn"
"""State of an alert that was wrong."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PastEvent:
    """An earthquake and its verdict."""

    event: Event
    verdict: Assessment
    """By its checks and the alerts that were open when it happened, as they are known today."""


def of_events(
    session: Session, building: Building, events: Sequence[Event], at: datetime | None = None
) -> list[Assessment]:
    """The assessments of some earthquakes of a building, in their order, as `reading.of_event` gives each.

    Args:
        session: to read with.
        building: theirs.
        events: all of this building.
        at: the open alerts are those of this time; None: of now.
    """
    return of_events_at(session, building, [(event, at) for event in events])


def of_events_at(
    session: Session, building: Building, events: Sequence[tuple[Event, datetime | None]]
) -> list[Assessment]:
    """The assessments of some earthquakes of a building, each by the alerts that were open at its time (None: now)."""
    then = history.open_at_each(session, building.id, {at for _, at in events if at is not None})
    now = history.open_at(session, building.id, None) if any(at is None for _, at in events) else ()
    compared = job_queue.is_monitoring_pending(session, building.id)
    by_event = [(event, now if at is None else then[at]) for event, at in events]
    return _assessed(session, building, by_event, lambda _: compared)


def past_events(session: Session, building: Building, limit: int) -> list[PastEvent]:
    """The building's latest earthquakes, the earliest of them first, by what is known of them today.

    Only the last one is provisional while a comparison is under way.

    Args:
        session: to read with.
        building: of the earthquakes.
        limit: earthquakes.
    """
    events = [line.Event for line in record_queries.events(session, building.id, Span(), None, None, limit)][::-1]
    if not events:
        return []
    alerts, compared = _alerts(session, building.id), job_queue.is_monitoring_pending(session, building.id)
    verdicts = _assessed(
        session,
        building,
        [(event, [(one, state) for one, state in alerts if _concerns(one, event)]) for event in events],
        lambda event: compared and event is events[-1],
    )
    return [PastEvent(event=event, verdict=one) for event, one in zip(events, verdicts, strict=True)]


def _assessed(
    session: Session,
    building: Building,
    events: Sequence[tuple[Event, Sequence[tuple[Alert, str]]]],
    is_being_compared: Callable[[Event], bool],
) -> list[Assessment]:
    """The assessments of the events, each by the alerts that concern it."""
    numbers = list({one.id for one, _ in events})
    current = select(Analysis).where(Analysis.event_id.in_(numbers), Analysis.current)
    analyses = {one.event_id: one for one in session.scalars(current)}
    of_analyses = [one.id for one in analyses.values()]
    directions = analysis_queries.by_analysis(session, DirectionResult, of_analyses)
    layers = analysis_queries.by_analysis(session, LayerResult, of_analyses)
    shaken = analysis_queries.by_analysis(session, ShakingResult, of_analyses)
    summed = {event: sums for event, _, sums in totals(session, [building.id], numbers)}
    largest, stiffness = _Largest(session, building), _stiffness(session, building, numbers)
    file = building_store.described(session, building)
    found = []
    for event, alerts in events:
        analysis = analyses.get(event.id)
        number = 0 if analysis is None else analysis.id
        facts = StoredFacts(
            file=file,
            results=sorted(directions.get(number, ()), key=lambda one: one.direction),
            layer=next(iter(layers.get(number, ())), None),
            shaking=next(iter(shaken.get(number, ())), None),
            totals=summed.get(event.id),
            largest_earlier=largest.before(event.start),
            stiffness=stiffness[event.id],
            is_being_compared=is_being_compared(event),
            alerts=alerts,
        )
        found.append(assess(event_facts(event, analysis, facts)))
    return found


def _alerts(session: Session, building_id: int) -> Sequence[tuple[Alert, str]]:
    """Alerts that were not withdrawn; one that has ended counts as it was while it was open."""
    query = select(Alert).where(Alert.building_id == building_id, Alert.state != WITHDRAWN).order_by(Alert.id)
    return [(one, one.state if one.closed_at is None else "active") for one in session.scalars(query)]


def _concerns(alert: Alert, event: Event) -> bool:
    """True if the alert was open when the earthquake happened, or its evidence includes it."""
    was_open = alert.began_at <= event.start and (alert.closed_at is None or alert.closed_at > event.start)
    return was_open or event.id in (*alert.event_ids, alert.onset_event_id, alert.raised_event_id)


class _Largest:
    """Largest displacements of a building (m) so far, by time."""

    def __init__(self, session: Session, building: Building) -> None:
        moved = history.largest_displacements(session, building.id)
        self._starts = [start for start, _ in moved]
        self._largest = list(accumulate((value for _, value in moved), max))

    def before(self, start: datetime) -> float | None:
        """The largest in the earthquakes before a time; None where none was measured."""
        number = bisect_left(self._starts, start)
        return self._largest[number - 1] if number else None


def _stiffness(session: Session, building: Building, events: Sequence[int]) -> Mapping[int, list[tuple[Any, ...]]]:
    """By event: the lines of `StoredFacts.stiffness`."""
    of_building = (MonitoredSeries.building_id == building.id, MonitoredSeries.quantity == "stiffness")
    columns = (MonitoredSeries.id, MonitoredSeries.subject, MonitoredSeries.wanted, *history.corrections())
    series = session.execute(select(*columns).where(*of_building).order_by(MonitoredSeries.subject)).all()
    of_series = DriftValue.series_id.in_([one.id for one in series])
    values = {
        (one.series_id, one.event_id): one
        for one in session.scalars(select(DriftValue).where(of_series, DriftValue.event_id.in_(events)))
    }
    return {number: [(*one[1:], values.get((one.id, number))) for one in series] for number in events}
