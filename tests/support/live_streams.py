"""A live stream with an earthquake, and a follower of it."""

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from monitoring_server import START, building_file, miniseed, stream
from obspy import Stream, UTCDateTime
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.records.streams.follower import Follower
from service.records.streams.seedlink import Received, Server
from service.records.tables import StreamState
from service.settings import Settings

NOW = START + timedelta(seconds=250)
SETTINGS = Settings(polling={"timeout": 5.0}, stream={"silence": 30.0})
SERVER = Server("seedlink://127.0.0.1:18000", "4", frozenset({"XX_TOWER"}))
SHAKING = slice(12_000, 13_500)
"""Samples: 15 s of 3 Hz, 0.3 m/s²."""


def ground_and_floors(seconds: float = 240) -> Stream:
    """Quiet noise with an earthquake."""
    whole = stream(seconds=seconds)
    for trace in whole:
        trace.data //= 100
        trace.data[SHAKING] += (3e5 * np.sin(2 * np.pi * 3 * np.arange(1500) / 100)).astype(np.int32)
    return whole


def packed(whole: Stream, step: int = 5) -> list[bytes]:
    """Packets in order of time, channels taking turns."""
    begin, end = UTCDateTime(START), whole[0].stats.endtime
    steps = range(0, round(end - begin) + 1, step)
    pieces = [miniseed(whole.slice(begin + at, begin + at + step - 0.005)) for at in steps if begin + at < end]
    return [piece[at : at + 512] for piece in pieces for at in range(0, len(piece), 512)]


SENT = ground_and_floors()
RECORDS = packed(SENT)


def received(data: list[bytes], first: int = 1) -> list[Received]:
    return [Received("XX_TOWER", number, one) for number, one in enumerate(data, start=first)]


def follower(sessions: sessionmaker[Session], address: str = SERVER.address, now: datetime = NOW) -> Follower:
    with sessions.begin() as session:
        building = building_store.add(session, building_file("seedlink", address), Path("/"), now)
        described = building_store.described(session, building)
        session.flush()
        session.expunge(building)
    assert described.source is not None
    one = Follower(sessions, SETTINGS, building, described, described.source, "here", lambda: now)
    one.hold()
    return one


def state(sessions: sessionmaker[Session]) -> StreamState:
    with sessions() as session:
        return session.scalars(select(StreamState)).one()
