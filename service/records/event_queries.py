"""What is asked about events, their files and how often they were analysed."""

from collections.abc import Sequence

from sqlalchemy import select, tuple_
from sqlalchemy.orm import Session, joinedload, selectinload

from service.analyses.tables import Analysis
from service.db.select import Line, Place, Question, Span
from service.errors import NotFoundError
from service.records.tables import Event, EventRecording, Recording


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


def event_with_analysis(session: Session, identity: int) -> Line:
    """(Event, its latest analysis or None).

    Raises:
        NotFoundError: there is no event by that number.
    """
    found = session.execute(_events().where(Event.id == identity)).one_or_none()
    if found is None:
        raise NotFoundError("event", identity)
    return found


def neighbours(session: Session, event: Event) -> tuple[Event | None, Event | None]:
    """The building's events just before and just after this one."""
    of_building = select(Event).where(Event.building_id == event.building_id).limit(1)
    here, there = tuple_(Event.start, Event.id), tuple_(event.start, event.id)
    before = session.scalars(of_building.where(here < there).order_by(Event.start.desc(), Event.id.desc()))
    after = session.scalars(of_building.where(here > there).order_by(Event.start, Event.id))
    return before.one_or_none(), after.one_or_none()


def analyses(session: Session, event_id: int) -> Sequence[Analysis]:
    """Every analysis of an event, the earliest first."""
    return session.scalars(select(Analysis).where(Analysis.event_id == event_id).order_by(Analysis.id)).all()


def recordings(session: Session, event_id: int) -> Sequence[Recording]:
    """The files that an event was cut from, by name."""
    question = select(Recording).join(EventRecording, EventRecording.recording_id == Recording.id)
    return session.scalars(question.where(EventRecording.event_id == event_id).order_by(Recording.name)).all()


def _events() -> Question:
    """(Event, its latest analysis or None)."""
    return select(Event, Analysis).outerjoin(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
