"""How far the service has come with the earthquakes that it fetched."""

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.records.tables import Event

SETTLED = ("analysed", "refused")


@dataclass(frozen=True, slots=True)
class Counts:
    """Numbers of events."""

    fetched: int
    settled: int
    """Analysed or refused."""


def counts(session: Session) -> Counts:
    """Of all events in the database."""
    by_state = dict(session.execute(select(Event.state, func.count()).group_by(Event.state)).tuples().all())
    return Counts(sum(by_state.values()), sum(by_state.get(state, 0) for state in SETTLED))


def settled_state(session: Session, after: datetime) -> str | None:
    """What became of the latest event that ends after a time: `analysed`, `refused`, or None while that is open."""
    settled = select(Event.state).where(Event.end > after, Event.state.in_(SETTLED))
    return session.scalar(settled.order_by(Event.id.desc()).limit(1))
