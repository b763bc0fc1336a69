"""What still stands at a receiver that forgets what it is not told again?"""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import exists, or_, select, update
from sqlalchemy.orm import Session, aliased

from service.db.leases import is_wrong
from service.notify.channels.alertmanager import STANDING
from service.notify.tables import Delivery, Message, Receiver


def due(session: Session, now: datetime, interval: timedelta) -> Sequence[Delivery]:
    """Deliveries to Alertmanagers of what is not over and has no later news, last repeated an interval ago."""
    later = aliased(Message)
    has_later = exists().where(
        later.building_id == Message.building_id, later.key == Message.key, later.number > Message.number
    )
    last = Delivery.kept_at
    question = (
        select(Delivery)
        .join(Delivery.message)
        .join(Delivery.receiver)
        .where(Receiver.kind == "alertmanager", Receiver.removed_at.is_(None))
        .where(Message.kind.in_(STANDING), Message.is_over.is_(False))
        .where(
            Delivery.state == "delivered",
            or_(last <= now - interval, is_wrong(last, now - interval, interval)),
            ~has_later,
        )
    )
    return session.scalars(question.order_by(Delivery.id)).all()


def kept(session: Session, delivery_id: int, now: datetime) -> None:
    """It was repeated."""
    session.execute(update(Delivery).where(Delivery.id == delivery_id).values(kept_at=now))
