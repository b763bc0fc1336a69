"""Events are cut from continuous files, across their borders, whatever the order they come in."""

from datetime import timedelta
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from monitoring_server import LOCATIONS, START, building_file, miniseed, stream
from obspy import UTCDateTime
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.jobs.tables import Job
from service.records.ingest import ingest
from service.records.tables import Event, Waveform
from service.settings import Settings

NOW = START + timedelta(days=1)
SETTINGS = Settings(trigger_before=20, trigger_after=30)
MINUTES = (0, 1, 2, 3, 4)


def minutes() -> list[bytes]:
    """Five files of one minute; 10 s of shaking begin 5 s before the third."""
    whole = stream(seconds=300)
    for trace in whole:
        trace.data //= 100
        within = slice(11_500, 12_500)
        trace.data[within] += (3e5 * np.sin(2 * np.pi * 3 * np.arange(1000) / 100)).astype(np.int32)
    begin = UTCDateTime(START)
    return [miniseed(whole.slice(begin + 60 * i, begin + 60 * i + 59.99)) for i in MINUTES]


@pytest.mark.parametrize("order", [MINUTES, (0, 2, 1, 4, 3), (4, 3, 2, 1, 0)])
def test_one_event_across_files(sessions: sessionmaker[Session], order: tuple[int, ...]) -> None:
    assert order in set(permutations(MINUTES))
    files = minutes()
    with sessions.begin() as session:
        building = building_store.add(session, building_file(more='data = "continuous"'), Path("/"), NOW)
    for number in order:
        with sessions.begin() as session:
            ingest(session, building, f"{number}.mseed", f"/{number}", files[number], NOW, settings=SETTINGS)
    with sessions() as session:
        event = session.scalars(select(Event)).one()
        assert event.state == "queued"
        assert (event.start - START).total_seconds() == pytest.approx(95, abs=1)
        assert (event.end - START).total_seconds() >= 155
        counts = session.execute(select(Waveform.channel, func.sum(Waveform.count)).group_by(Waveform.channel))
        expected = round((event.end - event.start).total_seconds() * 100) + 1
        assert [count for _, count in counts] == [expected] * len(LOCATIONS)
        assert session.scalar(select(func.count()).select_from(Job)) == 1


def test_quiet_files_make_no_event_and_are_kept(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = building_store.add(session, building_file(more='data = "continuous"'), Path("/"), NOW)
        recording = ingest(session, building, "a", "/a", miniseed(stream(seconds=120)), NOW, settings=SETTINGS)
        assert recording.state == "read"
        assert session.scalars(select(Event)).all() == []


def test_shaking_without_an_end_makes_no_event_without_an_end(sessions: sessionmaker[Session]) -> None:
    files, short = minutes(), Settings(trigger_before=20, trigger_after=30, longest_event=40.0)
    with sessions.begin() as session:
        building = building_store.add(session, building_file(more='data = "continuous"'), Path("/"), NOW)
        for number in MINUTES:
            ingest(session, building, f"{number}.mseed", f"/{number}", files[number], NOW, settings=short)
        event = session.scalars(select(Event)).one()
        assert (event.start - START).total_seconds() == pytest.approx(95, abs=1)
        assert 39 <= (event.end - event.start).total_seconds() <= 40
