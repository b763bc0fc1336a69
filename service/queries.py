"""What is asked of the database, by name: each question is one statement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Any

from sqlalchemy import Row, Select, bindparam, func, select, tuple_
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from service.database import (
    Analysis,
    ApiKey,
    Building,
    CycleResult,
    DirectionResult,
    Event,
    EventRecording,
    Job,
    Lease,
    ModeResult,
    Recording,
    Revision,
    SourceState,
    Waveform,
)
from service.errors import NotFoundError

Question = Select[*tuple[Any, ...]]
Line = Row[*tuple[Any, ...]]
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a page of a list ends: the next one starts just after it."""

    time: datetime
    id: int

    def __str__(self) -> str:
        return f"{(self.time - EPOCH) // timedelta(microseconds=1)}_{self.id}"

    @classmethod
    def read(cls, cursor: str) -> "Place":
        """The place that a cursor, as written by `str`, stands for."""
        microseconds, identity = cursor.split("_")
        return cls(EPOCH + timedelta(microseconds=int(microseconds)), int(identity))


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Which events: those that start at `after` or later and before `before`."""

    after: datetime | None = None
    before: datetime | None = None

    def limit(self, question: Question) -> Question:
        """The question about these events only."""
        if self.after is not None:
            question = question.where(Event.start >= self.after)
        return question if self.before is None else question.where(Event.start < self.before)


def keys_in_force(session: Session) -> Sequence[ApiKey]:
    """Keys that were not revoked."""
    return session.scalars(select(ApiKey).where(ApiKey.revoked_at.is_(None))).all()


def _latest_revision() -> Question:
    """Buildings, each with its latest description."""
    newest = (
        select(Revision.building_id, func.max(Revision.number).label("number"))
        .group_by(Revision.building_id)
        .subquery()
    )
    return (
        select(Building, Revision)
        .join(newest, newest.c.building_id == Building.id)
        .join(Revision, (Revision.building_id == Building.id) & (Revision.number == newest.c.number))
    )


def buildings(session: Session) -> Sequence[Line]:
    """(Building, Revision, number of events, start of the last one) by code."""
    events = (
        select(Event.building_id, func.count().label("events"), func.max(Event.start).label("last"))
        .group_by(Event.building_id)
        .subquery()
    )
    question = _latest_revision().add_columns(func.coalesce(events.c.events, 0), events.c.last)
    return session.execute(
        question.outerjoin(events, events.c.building_id == Building.id).order_by(Building.code)
    ).all()


def building(session: Session, code: str) -> tuple[Building, Revision]:
    """A building and its latest description.

    Raises:
        NotFoundError: there is none by that code.
    """
    row = session.execute(_latest_revision().where(Building.code == code)).one_or_none()
    if row is None:
        raise NotFoundError("building", code)
    return row.Building, row.Revision


def _events() -> Question:
    """(Event, its latest analysis or None)."""
    return select(Event, Analysis).outerjoin(Analysis, (Analysis.event_id == Event.id) & Analysis.current)


def events(
    session: Session, building_id: int, span: Span, min_pga: float | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """(Event, Analysis | None) of a building, the latest first."""
    question = span.limit(_events().where(Event.building_id == building_id))
    if min_pga is not None:
        question = question.where(Analysis.pga >= min_pga)
    if cursor is not None:
        question = question.where(tuple_(Event.start, Event.id) < tuple_(cursor.time, cursor.id))
    return session.execute(question.order_by(Event.start.desc(), Event.id.desc()).limit(limit)).all()


def last_analysed(session: Session, building_id: int) -> Sequence[Line]:
    """(Event, Analysis) of the building's latest event with a result; nothing before the first."""
    usable = _events().where(Event.building_id == building_id, Analysis.id.is_not(None), Analysis.refusal.is_(None))
    return session.execute(usable.order_by(Event.start.desc(), Event.id.desc()).limit(1)).all()


def event(session: Session, identity: int) -> Event:
    """An event with its building and its channels, without their samples.

    Raises:
        NotFoundError: there is none by that number.
    """
    question = select(Event).options(joinedload(Event.building), selectinload(Event.waveforms))
    found = session.scalars(question.where(Event.id == identity)).one_or_none()
    if found is None:
        raise NotFoundError("event", identity)
    return found


def analyses(session: Session, event_id: int) -> Sequence[Analysis]:
    """Every analysis of an event, the earliest first."""
    return session.scalars(select(Analysis).where(Analysis.event_id == event_id).order_by(Analysis.id)).all()


def recordings(session: Session, event_id: int) -> Sequence[Recording]:
    """The files that an event was cut from, by name."""
    question = select(Recording).join(EventRecording, EventRecording.recording_id == Recording.id)
    return session.scalars(question.where(EventRecording.event_id == event_id).order_by(Recording.name)).all()


def direction_results(session: Session, analysis_id: int) -> Sequence[DirectionResult]:
    """What an analysis found, by direction, with modes; without histories."""
    question = select(DirectionResult).options(selectinload(DirectionResult.modes))
    return session.scalars(
        question.where(DirectionResult.analysis_id == analysis_id).order_by(DirectionResult.direction)
    ).all()


def cycle_counts(session: Session, analysis_id: int) -> Mapping[int, int]:
    """Number of cycles that an analysis found, by its direction results' ids; those without any are not in it."""
    question = select(CycleResult.result_id, func.count()).group_by(CycleResult.result_id)
    question = question.join(DirectionResult).where(DirectionResult.analysis_id == analysis_id)
    return dict(session.execute(question).all())


def _forces() -> Question:
    """One direction of an event's analyses, by plain columns; made once, for that takes longer than asking."""
    direction, analysis = DirectionResult.__table__.c, Analysis.__table__.c
    event, building = Event.__table__.c, Building.__table__.c
    return (
        select(
            direction.id,
            direction.direction,
            event.id.label("event"),
            building.code.label("building"),
            analysis.id.label("analysis"),
            analysis.estimator,
            direction.start,
            direction.rate,
            direction["count"].label("length"),
            direction.peak_displacement,
        )
        .join(Analysis.__table__, analysis.id == direction.analysis_id)
        .join(Event.__table__, event.id == analysis.event_id)
        .join(Building.__table__, building.id == event.building_id)
        .where(event.id == bindparam("event"), direction.direction == bindparam("direction"))
    )


LATEST_FORCE = _forces().where(Analysis.__table__.c.current)
NAMED_FORCE = _forces().where(Analysis.__table__.c.id == bindparam("analysis"))


def restoring_force(session: Session, event_id: int, direction: str, analysis_id: int | None) -> Line:
    """One direction of an event's latest analysis, or of the one that is named, without its histories.

    Raises:
        NotFoundError: there is no such event, analysis or direction.
    """
    wanted = {"event": event_id, "direction": direction}
    if analysis_id is None:
        found = session.execute(LATEST_FORCE, wanted).one_or_none()
    else:
        found = session.execute(NAMED_FORCE, wanted | {"analysis": analysis_id}).one_or_none()
    if found is None:
        raise NotFoundError("result", f"event {event_id}, direction {direction}, analysis {analysis_id or 'latest'}")
    return found


def histories(session: Session, result_id: int, names: Sequence[str]) -> Line:
    """Histories of a direction's result, as stored, in the order of their names."""
    return session.execute(_histories(tuple(names)), {"result": result_id}).one()


@lru_cache(maxsize=256)  # as many as there are choices of the eight
def _histories(names: tuple[str, ...]) -> Question:
    table = DirectionResult.__table__
    return select(*(table.c[name] for name in names)).where(table.c.id == bindparam("result"))


def _results(building_id: int, span: Span, direction: str | None) -> Question:
    """Events of a building with a direction of their latest analysis."""
    question = (
        select(Event.id.label("event"), Event.start.label("event_start"), DirectionResult.direction)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id)
    )
    return span.limit(question if direction is None else question.where(DirectionResult.direction == direction))


def _cycles(building_id: int, span: Span, direction: str | None) -> Question:
    """Every cycle of every event's latest analysis; the last column is the cycle's id."""
    of_cycle = [CycleResult.__table__.c[name] for name in CYCLE]
    question = _results(building_id, span, direction).add_columns(
        DirectionResult.start.label("record_start"), *of_cycle
    )
    return question.join(CycleResult, CycleResult.result_id == DirectionResult.id).add_columns(CycleResult.id)


def cycles(
    session: Session, building_id: int, span: Span, direction: str | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """Every cycle of every event's latest analysis, the earliest first; the last column is the cycle's id."""
    question = _cycles(building_id, span, direction)
    if cursor is not None:
        question = question.where(tuple_(Event.start, CycleResult.id) > tuple_(cursor.time, cursor.id))
    return session.execute(question.order_by(Event.start, CycleResult.id).limit(limit)).all()


def latest_cycles(session: Session, building_id: int, direction: str, limit: int) -> Sequence[Line]:
    """The latest so many cycles, the earliest of them first; columns as those of `cycles`."""
    question = _cycles(building_id, Span(), direction)
    latest = session.execute(question.order_by(Event.start.desc(), CycleResult.id.desc()).limit(limit)).all()
    return latest[::-1]


CYCLE = ("start", "end", "amplitude", "shear_strain", "k_eq", "k_eq_std", "c_eq", "c_eq_std")


def modes(
    session: Session, building_id: int, span: Span, direction: str | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """Every mode of every event's latest analysis, the earliest first; the last column is the mode's id."""
    of_mode = [ModeResult.__table__.c[name] for name in MODE]
    question = _results(building_id, span, direction).add_columns(*of_mode)
    question = question.join(ModeResult, ModeResult.result_id == DirectionResult.id).add_columns(ModeResult.id)
    if cursor is not None:
        question = question.where(tuple_(Event.start, ModeResult.id) > tuple_(cursor.time, cursor.id))
    return session.execute(question.order_by(Event.start, ModeResult.id).limit(limit)).all()


MODE = ("number", "frequency", "frequency_std", "damping_ratio", "damping_ratio_std")


def sources(session: Session) -> Sequence[Line]:
    """(Building, Revision, SourceState | None) by code."""
    question = _latest_revision().add_columns(SourceState)
    return session.execute(
        question.outerjoin(SourceState, SourceState.building_id == Building.id).order_by(Building.code)
    ).all()


def jobs(session: Session, state: str | None, event_id: int | None, before: int | None, limit: int) -> Sequence[Job]:
    """Jobs, the latest first; `before` is the id at which the page before ended."""
    question = select(Job)
    for column, wanted in ((Job.state, state), (Job.event_id, event_id)):
        if wanted is not None:
            question = question.where(column == wanted)
    if before is not None:
        question = question.where(Job.id < before)
    return session.scalars(question.order_by(Job.id.desc()).limit(limit)).all()


def job(session: Session, identity: int) -> Job:
    """A job.

    Raises:
        NotFoundError: there is none by that number.
    """
    found = session.get(Job, identity)
    if found is None:
        raise NotFoundError("job", identity)
    return found


def lease_until(session: Session, name: str) -> datetime | None:
    """Until when a right is held, or was; None if nobody ever held it."""
    return session.scalar(select(Lease.until).where(Lease.name == name))


def channel(session: Session, event_id: int, name: str) -> tuple[Event, Sequence[Waveform]]:
    """An event and the pieces of one of its channels with their samples, in order of time.

    Raises:
        NotFoundError: there is no such event, or it has no such channel.
    """
    found = session.scalars(select(Event).options(joinedload(Event.building)).where(Event.id == event_id)).one_or_none()
    if found is None:
        raise NotFoundError("event", event_id)
    question = select(Waveform).options(undefer(Waveform.samples)).where(Waveform.event_id == event_id)
    pieces = session.scalars(question.where(Waveform.channel == name).order_by(Waveform.start)).all()
    if not pieces:
        raise NotFoundError(f"channel in event {event_id}", name)
    return found, pieces


def epochs(session: Session) -> Sequence[tuple[Building, Line]]:
    """Every building's channels, each with its spans of time of unchanged gain and rate, in order of time."""
    channel = (Event.building_id, Waveform.channel)
    kind = (*channel, Waveform.gain, Waveform.rate)
    order = (Waveform.start, Waveform.id)
    of_channel = func.row_number().over(partition_by=channel, order_by=order)
    of_kind = func.row_number().over(partition_by=kind, order_by=order)
    pieces = select(  # of pieces that follow each other unchanged the two numbers differ by the same
        *kind, Waveform.start, Event.end, (of_channel - of_kind).label("run")
    ).join(Waveform.event)
    piece = pieces.subquery().c
    same = (piece.building_id, piece.channel, piece.gain, piece.rate)
    start = func.min(piece.start)
    question = select(*same, start.label("start"), func.max(piece.end).label("end")).group_by(*same, piece.run)
    known = {building.id: building for building in session.scalars(select(Building))}
    rows = session.execute(question.order_by(piece.building_id, piece.channel, start))
    return [(known[row.building_id], row) for row in rows]


def pieces(session: Session, start: datetime, end: datetime) -> Sequence[Line]:
    """(id, channel, start, rate, count) of the waveforms of events that overlap a span of time."""
    columns = (Waveform.id, Waveform.channel, Waveform.start, Waveform.rate, Waveform.count)
    question = select(*columns).join(Event, Event.id == Waveform.event_id)
    return session.execute(question.where(Event.start <= end, Event.end >= start)).all()


def samples(session: Session, numbers: Sequence[int]) -> Sequence[Waveform]:
    """These waveforms with their samples."""
    question = select(Waveform).options(undefer(Waveform.samples)).where(Waveform.id.in_(numbers))
    return session.scalars(question.order_by(Waveform.channel, Waveform.start)).all()


def loop(session: Session, result_id: int) -> Line:
    """Rate, displacement and force of a direction's result, as stored.

    Raises:
        NotFoundError: there is no such result, or nothing measured its displacement.
    """
    question = select(DirectionResult.rate, DirectionResult.displacement, DirectionResult.force)
    usable = question.where(DirectionResult.id == result_id, DirectionResult.displacement.is_not(None))
    found = session.execute(usable).one_or_none()
    if found is None:
        raise NotFoundError("loop of result", result_id)
    return found
