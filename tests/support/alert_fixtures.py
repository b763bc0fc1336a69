"""A building with analysed earthquakes, as far as messages need them, and its alerts."""

from dataclasses import replace
from datetime import datetime, timedelta
from itertools import count
from pathlib import Path

import paper_records
from alert_candidates import DAY, START, softer_isolators
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.candidates import AlertCandidate
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.analyses.tables import Analysis, DirectionResult
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db.blobs import encode
from service.jobs import queue as job_queue
from service.notify.tables import Message
from service.records.tables import Event

NUMBERS = count(1)
AGE = timedelta(days=2)
"""Greatest age at which a normal earthquake is reported."""
SOON = timedelta(minutes=10)


def building(session: Session, timezone: str = "Asia/Tokyo") -> Building:
    """A new one like the paper's, with a code of its own."""
    text = paper_records.building_file().replace('"PAPER"', f'"B{next(NUMBERS)}"', 1)
    made = building_store.add(session, f'timezone = "{timezone}"\n{text}', Path("/"), START)
    session.flush()
    return made


def earthquake(session: Session, of: Building, start: datetime, displacement: float | None = 0.024) -> Event:
    """One that ended five minutes later, and was analysed at once."""
    end = start + timedelta(minutes=5)
    event = Event(building_id=of.id, start=start, end=end, state="gathering", created_at=end, updated_at=end)
    session.add(event)
    session.flush()
    analysed(session, event, end, displacement)
    return event


def analysed(
    session: Session, event: Event, now: datetime, displacement: float | None = 0.024, refusal: str | None = None
) -> Analysis:
    """The event's latest analysis, with the layer's largest displacement in x (m)."""
    job = job_queue.enqueue(session, event, {"number": next(NUMBERS)}, now)
    job.state = "done"
    session.execute(update(Analysis).where(Analysis.event_id == event.id).values(current=False))
    event.state, event.reason = ("analysed", None) if refusal is None else ("refused", refusal)
    made = Analysis(
        event_id=event.id,
        job_id=job.id,
        revision_id=building_store.current(session, session.get_one(Building, event.building_id)).id,
        current=True,
        created_at=now,
        version="test",
        settings={},
        inputs=[],
        quality=[],
        refusal=refusal,
        peaks={},
        pga=None if refusal else 0.5,
        directions=[] if refusal else [direction(event, displacement)],
    )
    session.add(made)
    session.flush()
    return made


def direction(event: Event, displacement: float | None) -> DirectionResult:
    """Direction x; values without a role here are empty."""
    none = encode(paper_records.BUILDING.floor_mass[:0])
    return DirectionResult(
        direction="x",
        start=event.start,
        rate=100.0,
        count=0,
        peak_force=1.2e6,
        force_std=1e4,
        peak_displacement=displacement,
        peak_displacement_std=None if displacement is None else 1e-4,
        force=none,
        force_rigid=none,
        force_modal=none,
        force_std_history=none,
    )


def three_earthquakes(session: Session, of: Building) -> tuple[int, int, int]:
    """Numbers of those that the findings of tests/support/alert_candidates.py are about, a day apart."""
    first, second, third = (earthquake(session, of, START + number * DAY).id for number in range(3))
    return first, second, third


def open_alerts(session: Session, of: Building) -> set[tuple[object, ...]]:
    """The building's open alerts as people see them."""
    found = session.scalars(select(Alert).where(Alert.building_id == of.id, Alert.closed_at.is_(None)))
    return {
        (one.cause, one.state, one.held_by, one.acknowledged_by, one.summary, one.began_at, len(one.event_ids))
        for one in found
    }


def messages(session: Session) -> list[Message]:
    """All, in their order."""
    session.flush()
    return session.query(Message).order_by(Message.id).all()


def raise_softening(session: Session, of: Building, *found: AlertCandidate, softer_by: float = 8.0) -> tuple[int, ...]:
    """Three earthquakes and what they show."""
    events = three_earthquakes(session, of)
    shown = [with_stored_events(one, events) for one in (softer_isolators(softer_by), *found)]
    reconcile(session, of.id, shown, "events", START + 3 * DAY)
    session.flush()
    return events


def with_stored_events(found: AlertCandidate, events: tuple[int, ...]) -> AlertCandidate:
    """The same with the numbers that these earthquakes have in the database."""
    return replace(
        found,
        onset_event_id=events[0],
        raised_event_id=events[(found.raised_event_id or 1) - 1],
        event_ids=events[: len(found.event_ids)],
    )


def with_events(found: AlertCandidate, onset: int, raised: int, events: tuple[int, ...]) -> AlertCandidate:
    """The same with other earthquakes, counted from 0."""
    return replace(
        found,
        began_at=START + onset * DAY,
        raised_at=START + raised * DAY,
        onset_event_id=events[onset],
        raised_event_id=events[raised],
        event_ids=events[onset : raised + 1],
    )


def states(sessions: sessionmaker[Session]) -> dict[str, str]:
    """State of each alert by its cause."""
    with sessions() as session:
        return {alert.cause: alert.state for alert in session.query(Alert)}


def reported(sessions: sessionmaker[Session]) -> list[tuple[str, str, str]]:
    """Kind, sequence and severity of each message, the oldest first."""
    with sessions() as session:
        return [(one.kind, one.sequence, one.severity) for one in session.query(Message).order_by(Message.id)]
