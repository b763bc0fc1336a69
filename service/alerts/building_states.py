"""The stored state of the buildings as the periodic checks read it: one statement per subject for all of them."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Text, cast, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased

from service.alerts.data_health import Rejected, Sighting
from service.alerts.tables import Alert, AlertChange, Inspection, Silence
from service.analyses.tables import Analysis
from service.buildings.tables import Building, Revision
from service.db.select import Line, Question
from service.jobs.queue import UNDER_WAY, WATCH
from service.jobs.tables import Job
from service.notify.tables import Receiver
from service.records.tables import (
    READ,
    REJECTED,
    Event,
    EventRecording,
    RecordedChannel,
    Recording,
    SourceState,
    StreamState,
    Waveform,
)

Values = tuple[Any, ...]
LATEST = 50
"""Latest earthquakes in which dead channels are looked for."""


@dataclass(frozen=True, slots=True)
class BuildingState:
    """A building as stored at one time."""

    created_at: datetime
    events: tuple[object, ...]
    """Version of its description and its events."""
    news: tuple[object, ...]
    """Version of everything else that its messages report: alerts, current silences, recipients, drift monitoring."""
    poll: Values | None
    """(attempted_at, succeeded_at, failing_since, error, clock_ahead) of its source; None before the first poll."""
    last_record: Values | None
    """(end, received_at) of the latest usable recording; None before the first."""
    rejected: Rejected | None
    """Rejected files that count; None if there are none."""
    silent: Mapping[str, datetime]
    """Time since which each silent channel of its live stream is silent."""


def read(
    session: Session, rejected_age: timedelta, now: datetime, building_id: int | None = None
) -> dict[int, BuildingState]:
    """The state of each building, by its number, in the order of the codes.

    The number of statements does not depend on the number of buildings.

    Args:
        session: to read with.
        rejected_age: time for which a rejected file counts.
        now: aware time.
        building_id: of one building; None: all of them.
    """
    polls, records = _polls(session, building_id), _last_records(session, building_id)
    rejected, pending = _rejected(session, now - rejected_age, building_id), _monitoring(session, building_id)
    silences, receivers = _silences(session, now, building_id), _receivers(session, building_id)
    silent = _silent(session, building_id)
    return {
        number: BuildingState(
            created_at=created_at,
            events=events,
            news=(*alerts, pending.get(number), *silences.get(number, ()), *receivers.get(number, ())),
            poll=polls.get(number),
            last_record=records.get(number),
            rejected=rejected.get(number),
            silent=silent.get(number, {}),
        )
        for number, created_at, events, alerts in _versions(session, building_id)
    }


def channels_ever(session: Session, building_id: int) -> set[str]:
    """Channels that the building has ever recorded."""
    query = select(RecordedChannel.channel).where(RecordedChannel.building_id == building_id)
    return set(session.scalars(query))


def sightings(session: Session, building_id: int) -> list[Sighting]:
    """The latest earthquakes, each with its channels except dead ones."""
    rows = _latest_events(session, building_id)
    numbers = [row.id for row in rows]
    recorded, files = _channels(session, numbers), _files(session, numbers)
    return [
        Sighting(
            event=row.id,
            start=row.start,
            channels=recorded.get(row.id, set()) - (dead := _dead(row.quality)).keys(),
            findings=dead,
            files=files.get(row.id, ()),
        )
        for row in rows
    ]


def _versions(session: Session, building_id: int | None) -> list[tuple[int, datetime, Values, Values]]:
    """(number, created_at, version of its events, version of its alerts) of each building.

    Each value is a subquery of its own that takes an index: the history of a building is counted, not read.
    """
    events, alerts = Event.building_id == Building.id, Alert.building_id == Building.id
    changes = select(func.max(AlertChange.id)).join(Alert, Alert.id == AlertChange.alert_id)
    query: Question = select(
        Building.id,
        Building.created_at,
        select(func.max(Revision.number)).where(Revision.building_id == Building.id).scalar_subquery(),
        select(func.count()).where(events).scalar_subquery(),
        select(func.max(Event.updated_at)).where(events).scalar_subquery(),
        select(func.count()).where(alerts).scalar_subquery(),
        select(func.max(Alert.updated_at)).where(alerts).scalar_subquery(),
        changes.where(alerts).scalar_subquery(),
    )
    rows = session.execute(query.where(*_only(Building.id, building_id)).order_by(Building.code))
    return [(row[0], row[1], row[2:5], row[5:8]) for row in rows]


def _polls(session: Session, building_id: int | None) -> Mapping[int, Values]:
    columns = (SourceState.attempted_at, SourceState.succeeded_at, SourceState.failing_since, SourceState.error)
    query = select(SourceState.building_id, *columns, SourceState.clock_ahead)
    return _by_building(session, query.where(*_only(SourceState.building_id, building_id)))


def _silent(session: Session, building_id: int | None) -> Mapping[int, Mapping[str, datetime]]:
    query = select(StreamState.building_id, StreamState.silent).where(StreamState.silent.is_not(None))
    return {
        building: {channel: datetime.fromisoformat(since) for channel, since in silent.items()}
        for building, silent in session.execute(query.where(*_only(StreamState.building_id, building_id)))
        if silent is not None
    }


def _last_records(session: Session, building_id: int | None) -> Mapping[int, Values]:
    usable = (Recording.building_id == Building.id, READ, Recording.end.is_not(None))
    newest = select(Recording.id).where(*usable).order_by(Recording.end.desc()).limit(1).scalar_subquery()
    last = aliased(Recording)
    query = select(Building.id, last.end, last.received_at).join(last, last.id == newest)
    return _by_building(session, query.where(*_only(Building.id, building_id)))


def _rejected(session: Session, since: datetime, building_id: int | None) -> Mapping[int, Rejected]:
    """Files rejected as a whole, received since then, and after the last inspection of the alert about them."""
    inspected = (
        select(func.max(Inspection.at))
        .join(Alert, Alert.id == Inspection.alert_id)
        .where(Alert.building_id == Recording.building_id, Alert.cause == "rejected")
        .scalar_subquery()
    )
    order = (Recording.received_at, Recording.id)
    of_building = Recording.building_id
    files = (
        select(
            of_building,
            func.count().over(partition_by=of_building).label("number"),
            func.row_number().over(partition_by=of_building, order_by=order).label("place"),
            Recording.name,
            Recording.received_at,
            Recording.reason,
        )
        .where(REJECTED, Recording.received_at > since, *_only(of_building, building_id))
        .where(Recording.received_at > func.coalesce(inspected, since))
        .subquery()
        .c
    )
    first = select(files.building_id, files.number, files.name, files.received_at, files.reason).where(files.place == 1)
    return {
        building: Rejected(number=number, name=name, at=at, reason=(reason or "").rstrip("."))
        for building, number, name, at, reason in session.execute(first)
    }


def _monitoring(session: Session, building_id: int | None) -> Mapping[int, int]:
    """The last job under way that monitors a building's drift, for each building that has one."""
    query = select(Job.building_id, func.max(Job.id)).where(Job.state.in_(UNDER_WAY), Job.kind == WATCH)
    rows = session.execute(query.where(*_only(Job.building_id, building_id)).group_by(Job.building_id))
    return {building: last for building, last in rows if building is not None}


def _silences(session: Session, now: datetime, building_id: int | None) -> Mapping[int, list[object]]:
    current = (Silence.starts_at <= now, Silence.ends_at > now, *_only(Silence.building_id, building_id))
    return _lists(session, select(Silence.building_id, Silence.id).where(*current).order_by(Silence.id))


def _receivers(session: Session, building_id: int | None) -> Mapping[int, list[object]]:
    wanted = (cast(Receiver.kinds, Text), cast(Receiver.severities, Text))
    there = (Receiver.removed_at.is_(None), *_only(Receiver.building_id, building_id))
    query = select(Receiver.building_id, Receiver.id, Receiver.since, *wanted)
    return _lists(session, query.where(*there).order_by(Receiver.id))


def _only(column: InstrumentedAttribute[Any], building_id: int | None) -> tuple[ColumnElement[bool], ...]:
    return () if building_id is None else (column == building_id,)


def _by_building(session: Session, query: Question) -> dict[int, Values]:
    """The row of each building, without its number, which comes first."""
    return {row[0]: row[1:] for row in session.execute(query)}


def _lists(session: Session, query: Question) -> dict[int, list[object]]:
    """All rows of each building, without its number."""
    rows: dict[int, list[object]] = defaultdict(list)
    for row in session.execute(query):
        rows[row[0]].append(row[1:])
    return rows


def _latest_events(session: Session, building_id: int) -> Sequence[Line]:
    """(number, start, screening findings or None) of the building's latest events, the earliest first.

    Events that wait for files or their analysis are omitted.
    """
    ended = (Event.building_id == building_id, Event.state.in_(("analysed", "refused")))
    query = select(Event.id, Event.start, Analysis.quality).outerjoin(
        Analysis, (Analysis.event_id == Event.id) & Analysis.current
    )
    return session.execute(query.where(*ended).order_by(Event.start.desc()).limit(LATEST)).all()[::-1]


def _channels(session: Session, events: Sequence[int]) -> Mapping[int, set[str]]:
    """Recorded channels by event; events without any are omitted."""
    channels: dict[int, set[str]] = {}
    query = select(Waveform.event_id, Waveform.channel).where(Waveform.event_id.in_(events)).distinct()
    for event, channel in session.execute(query):
        channels.setdefault(event, set()).add(channel)
    return channels


def _files(session: Session, events: Sequence[int]) -> Mapping[int, tuple[str, ...]]:
    """Names of the files and downloads of each event, in order of arrival."""
    query = select(EventRecording.event_id, Recording.name).join(Recording, Recording.id == EventRecording.recording_id)
    files: dict[int, tuple[str, ...]] = {}
    for event, name in session.execute(query.where(EventRecording.event_id.in_(events)).order_by(Recording.id)):
        files[event] = (*files.get(event, ()), name)
    return files


def _dead(quality: Sequence[dict[str, Any]] | None) -> dict[str, str]:
    """Data quality finding of each dead channel."""
    return {finding["channel"]: finding["message"] for finding in quality or () if finding["kind"] == "dead"}
