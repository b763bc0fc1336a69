"""Does the service really work, so that it may say so outside?"""

from collections.abc import Iterator, Mapping
from datetime import datetime

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from service.database import Alert
from service.queries import work
from service.queue.leases import POLLING, WORKING

PARTS: Mapping[str, str] = {POLLING: "no poller was seen lately", WORKING: "no worker was seen lately"}


def lacks(session: Session, now: datetime) -> Iterator[str]:
    """Everything for which the service cannot be said to work."""
    for right, lack in PARTS.items():
        until = work.lease_until(session, right)
        if until is None or until < now:
            yield lack
    if session.scalar(select(exists().where(Alert.cause == "worker", Alert.closed_at.is_(None)))):
        yield "records wait for their analysis while nothing gets done"
