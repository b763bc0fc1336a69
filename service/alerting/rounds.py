"""What is done about alerts whenever some time has passed, whether anything came or not."""

from datetime import datetime, timedelta

from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerting.event_messages import tell
from service.alerting.reconciling import reconcile
from service.alerting.reminders import remind
from service.alerting.stop_reading import found_by_clock
from service.database import Building
from service.sessions import reading
from service.settings import Settings


def go_round(sessions: sessionmaker[Session], settings: Settings, now: datetime) -> None:
    """Look at every building whether its data stopped, tell people what is new, and remind them of what waits."""
    with reading(sessions)() as session:
        buildings = session.scalars(select(Building).order_by(Building.code)).all()
        found = {building.id: found_by_clock(session, building, settings, now) for building in buildings}
    age = timedelta(seconds=settings.message_age)
    for building_id, ones in found.items():
        with sessions.begin() as session:
            reconcile(session, building_id, ones, "clock", now)
            session.flush()
            tell(session, building_id, age, now)
            remind(session, building_id, timedelta(seconds=settings.reminder_interval), now)
