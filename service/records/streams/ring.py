"""The ring buffer: a stream's packets in the database, as they came, for as long as the settings say."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import and_, delete, not_, select, update
from sqlalchemy.orm import Session

from service.buildings.tables import Building
from service.db.upsert import insert_into
from service.records.ingest import CLOCK_SLACK
from service.records.recordings import storable
from service.records.streams.packets import Packet
from service.records.streams.seedlink import Received
from service.records.tables import Packet as Kept

LARGEST_SEQUENCE = 2**63 - 1
"""The database's largest integer; SeedLink 4 means "unknown" by the largest ones."""

TRIMMED = 500
"""Packets that are removed at a time. Every stream removes as many every 15 s, and brings fewer. Not tuned."""


def keep(session: Session, building: Building, packets: Sequence[Packet], now: datetime) -> frozenset[str]:
    """Keep the packets that the building does not have yet; returns the digests of these."""
    if not packets:
        return frozenset()
    rows = [_row(building, packet, now) for packet in packets]
    insert = insert_into(session, Kept).on_conflict_do_nothing().returning(Kept.sha256)
    return frozenset(session.scalars(insert, rows))


def mend(session: Session, building: Building, packets: Sequence[Packet], now: datetime) -> Mapping[str, int]:
    """Make those packets usable that were rejected before and can be used now; returns their ids by digest."""
    usable = [one.digest for one in packets if one.reason is None]
    rejected = (Kept.building_id == building.id, Kept.sha256.in_(usable), Kept.reason.is_not(None))
    mended = update(Kept).where(*rejected).values(reason=None, received_at=now).returning(Kept.sha256, Kept.id)
    found = session.execute(mended, execution_options={"synchronize_session": False})
    return {one.sha256: one.id for one in found}


def past(session: Session, building_id: int, before: datetime, now: datetime) -> list[int]:
    """Ids of the packets that were rejected as of the future and no longer are, in order of time.

    All packets since `before` are read for it.
    """
    times = select(Kept.id, Kept.end, Kept.received_at).where(
        Kept.building_id == building_id, Kept.end > before, Kept.end <= now + CLOCK_SLACK, Kept.reason.is_not(None)
    )
    rows = session.execute(times.order_by(Kept.end, Kept.id))
    return [number for number, end, received_at in rows if end > received_at + CLOCK_SLACK]


def as_received(session: Session, numbers: Sequence[int]) -> list[Received]:
    """Packets as they came, by their ids."""
    columns = select(Kept.station, Kept.sequence, Kept.data).where(Kept.id.in_(numbers))
    return [Received(*row) for row in session.execute(columns.order_by(Kept.id))]


def _row(building: Building, packet: Packet, now: datetime) -> dict[str, Any]:
    number = packet.sequence
    return {
        "building_id": building.id,
        "station": storable(packet.station),
        "sequence": number if number is not None and number <= LARGEST_SEQUENCE else None,
        "channel": storable(packet.channel),
        "start": packet.start,
        "end": packet.end,
        "received_at": now,
        "reason": None if packet.reason is None else storable(packet.reason),
        "sha256": packet.digest,
        "data": packet.data,
    }


def since(session: Session, building_id: int, number: int) -> Sequence[Kept]:
    """The usable packets after one of this id, in the order in which they came, without their bytes."""
    later = (Kept.building_id == building_id, Kept.id > number, Kept.reason.is_(None))
    return session.scalars(select(Kept).where(*later).order_by(Kept.id)).all()


def between(session: Session, building_id: int, start: datetime, end: datetime) -> bytes:
    """The bytes of the usable packets that reach into a span of time, by channel and time."""
    within = (Kept.building_id == building_id, Kept.end >= start, Kept.start <= end, Kept.reason.is_(None))
    return b"".join(session.scalars(select(Kept.data).where(*within).order_by(Kept.channel, Kept.start, Kept.id)))


def trim(session: Session, before: datetime, now: datetime) -> None:
    """Remove the oldest packets, of all buildings, if they came before a time; TRIMMED of them at most.

    Rejected ones that are later than that by their own time stay: they came while the machine's clock was set back.
    """
    came_early = and_(Kept.reason.is_not(None), Kept.end >= before, Kept.end <= now + CLOCK_SLACK)
    oldest = select(Kept.id, Kept.received_at).where(not_(came_early)).order_by(Kept.id).limit(TRIMMED)
    oldest = oldest.with_for_update(skip_locked=True)
    old = [number for number, received_at in session.execute(oldest) if received_at < before]
    if old:
        session.execute(delete(Kept).where(Kept.id.in_(old)))
