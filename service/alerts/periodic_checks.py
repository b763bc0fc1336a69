"""What is done about alerts whenever some time has passed, whether anything came or not."""

from collections.abc import Callable
from datetime import datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.data_health_facts import found_by_clock
from service.alerts.event_messages import tell
from service.alerts.reconciling import reconcile
from service.alerts.reminders import remind
from service.buildings.tables import Building
from service.db.sessions import reading
from service.settings import Settings


def go_round(
    sessions: sessionmaker[Session], settings: Settings, now: datetime, stopped: Callable[[], bool] = lambda: False
) -> None:
    """Look at every building whether its data stopped, tell people what is new, and remind them of what waits.

    Args:
        sessions: of the database.
        settings: of the service.
        now: aware time.
        stopped: asked before each building; the others are then left to the next round.
    """
    age = timedelta(seconds=settings.notify.max_event_age)
    with reading(sessions)() as session:
        numbers = session.scalars(select(Building.id).order_by(Building.code)).all()
    for building_id in numbers:
        if stopped():
            return
        with reading(sessions)() as session:
            ones = found_by_clock(session, session.get_one(Building, building_id), settings, now)
        with sessions.begin() as session:
            reconcile(session, building_id, ones, "clock", now)
            session.flush()
            tell(session, building_id, age, now)
            remind(session, building_id, timedelta(seconds=settings.notify.reminder_interval), now)
