"""Recipients who were none when an alert was reported: they get the last message about it while it is open."""

from collections.abc import Iterator
from datetime import datetime

from sqlalchemy.orm import Session

from service.alerts import queries
from service.alerts.alert_messages import thread
from service.alerts.event_reading import GRAVITY
from service.alerts.silences import silence_of
from service.alerts.states import PENDING
from service.alerts.telling import tellings
from service.notify import outbox


def tell_newcomers(session: Session, building_id: int, now: datetime) -> None:
    """Send what is active, acknowledged or on hold to every recipient who should have it and was none before.

    Repeating it changes nothing: each message goes to each recipient once.
    """
    keys = sorted(set(_threads(session, building_id, now)))
    last = [messages[-1] for key in keys if (messages := queries.messages(session, building_id, key))]
    if last:
        outbox.hand_on(session, building_id, last, now)


def _threads(session: Session, building_id: int, now: datetime) -> Iterator[str]:
    """Under which messages the open alerts were reported; of those that are silenced nothing is sent."""
    open_ones = [one for one in queries.open_alerts(session, building_id, GRAVITY) if one.state != PENDING]
    if not open_ones:
        return
    told, silences = tellings(session, building_id), queries.silences(session, building_id)
    for one in open_ones:
        if (one.raised_event_id is None or one.id in told) and silence_of(one, silences, now) is None:
            yield thread(session, one, told)
