"""The paper's building after some earthquakes, with all data from records.

A folder source was polled, its files were ingested, and the worker analysed the events.
"""

import os
from collections.abc import Sequence
from datetime import datetime, timedelta
from functools import cache
from pathlib import Path

import numpy as np
import paper_records
from cached_executor import CachedExecutor
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.records.source_poller import SourcePoller
from service.settings import Settings

NOW = paper_records.START + timedelta(days=200)
"""After the last earthquake, and before any day on which tests run: results of the future look like a set clock."""
APART = timedelta(days=30)
SETTINGS = Settings(workers=1, settle_time=0, event_grace=0)
SCALES = (0.2, 0.5, 1.0)
"""Scales of the ground motion in the analysed earthquakes, the earliest first."""
BASE = "XX.PAPER.01.HNX"


@cache
def earthquakes() -> tuple[bytes, ...]:
    """miniSEED of one earthquake for each of SCALES, and of one more without the base slab, which is refused."""
    files = [
        paper_records.miniseed(paper_records.records(np.random.default_rng(number), scale), later=number * APART)
        for number, scale in enumerate(SCALES)
    ]
    without_base = paper_records.records(np.random.default_rng(9), 0.3)
    del without_base[BASE]
    return (*files, paper_records.miniseed(without_base, later=len(SCALES) * APART))


def start(number: int) -> datetime:
    """Start of an earthquake, counted from 0."""
    return paper_records.START + number * APART


def watch(sessions: sessionmaker[Session], folder: Path, files: Sequence[bytes] | None = None) -> None:
    """Watch the building through a folder that holds these files, and analyse all that comes of them."""
    for number, data in enumerate(earthquakes() if files is None else files):
        write(folder / f"{number}.mseed", data)
    with sessions.begin() as session:
        building_store.add(session, building_file(folder), folder, NOW)
    poller = SourcePoller(sessions, SETTINGS, lambda: NOW, lambda _: None, lambda: False)
    poller.poll("PAPER")
    poller.queue_ready()
    work(sessions)


def work(sessions: sessionmaker[Session]) -> None:
    """Do all work that waits."""
    Worker(sessions, CachedExecutor, SETTINGS, KINDS, clock=lambda: NOW).run_until_idle()


def write(file: Path, data: bytes) -> None:
    """Write a file as old as NOW: the first look at a file of the future waits for a second."""
    file.write_bytes(data)
    os.utime(file, (NOW.timestamp(), NOW.timestamp()))


def building_file(folder: Path) -> str:
    """The paper's building, watched through a folder."""
    source = f'[source]\nkind = "folder"\nlocation = "{folder}"\n'
    return paper_records.building_file().replace("[isolation]", source + "[isolation]", 1)
