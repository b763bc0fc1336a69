"""The simulated building's past and future in a folder: earthquakes and the records that are made of them."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from service.demo.archive import Archive
from service.demo.catalogue import Earthquake, history, next_earthquake, quakeml
from service.demo.motions import GroundMotion
from service.demo.recorder import BEFORE, duration, record
from service.demo.site import LATITUDE, LONGITUDE, inventory

FILE = "earthquakes.json"
SEED = 2006


def remembered(folder: Path, now: datetime, count: int, motions: Sequence[GroundMotion]) -> tuple[Earthquake, ...]:
    """The earthquakes that the folder remembers; the first time, new ones until now."""
    path = folder / FILE
    if not path.exists():
        names = [motion.name for motion in motions]
        remember(folder, history(now, count, names, np.random.default_rng(SEED)))
    rows = json.loads(path.read_text())
    return tuple(Earthquake(**{**row, "arrival": datetime.fromisoformat(row["arrival"])}) for row in rows)


def remember(folder: Path, earthquakes: Sequence[Earthquake]) -> None:
    """Write the earthquakes down, all or none of them."""
    rows = [{**asdict(earthquake), "arrival": earthquake.arrival.isoformat()} for earthquake in earthquakes]
    fresh = folder / f"{FILE}.new"
    fresh.write_text(json.dumps(rows, indent=1))
    fresh.replace(folder / FILE)


def archive(earthquakes: Sequence[Earthquake], motions: Sequence[GroundMotion], done: Callable[[], None]) -> Archive:
    """The monitoring server's archive of these earthquakes; `done` is called after each."""
    held = Archive(inventory())
    for earthquake in earthquakes:
        strike(held, earthquake, motions)
        done()
    return held


def strike(held: Archive, earthquake: Earthquake, motions: Sequence[GroundMotion]) -> None:
    """Record an earthquake."""
    motion = next(motion for motion in motions if motion.name == earthquake.motion)
    held.add(record(earthquake, motion, SEED), quakeml(earthquake, LATITUDE, LONGITUDE))


def one_more(folder: Path, earlier: Sequence[Earthquake], now: datetime, motions: Sequence[GroundMotion]) -> Earthquake:
    """An earthquake whose record has just ended."""
    shortest = sorted(motions, key=duration)[: len(motions) // 2]
    names = [motion.name for motion in shortest]
    fresh = next_earthquake(earlier, now, names, np.random.default_rng([SEED, len(earlier)]))
    motion = next(motion for motion in shortest if motion.name == fresh.motion)
    ended = replace(fresh, arrival=now - duration(motion) + timedelta(seconds=BEFORE))
    remember(folder, (*earlier, ended))
    return ended
