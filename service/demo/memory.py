"""The simulated building's past and future in a folder: earthquakes and the records that are made of them."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from service.demo.archive import Archive
from service.demo.catalogue import Earthquake, history, next_earthquake, quakeml
from service.demo.motions import GroundMotion
from service.demo.recorder import record
from service.demo.scenario import Scenario
from service.demo.site import AFTER_ORIGIN, LATITUDE, LONGITUDE

FILE = "earthquakes.json"
SEED = 2006
RECORDED = timedelta(seconds=AFTER_ORIGIN)
"""After which the record of an earthquake is complete, however long its motion."""
APART = timedelta(minutes=5)


def remembered(
    folder: Path, now: datetime, count: int, scenario: Scenario, motions: Sequence[GroundMotion]
) -> tuple[Earthquake, ...]:
    """The earthquakes that the folder remembers; the first time, new ones until now."""
    path = folder / FILE
    if not path.exists():
        names = [motion.name for motion in motions]
        remember(folder, history(now, count, scenario.peaks, names, np.random.default_rng(SEED)))
    rows = json.loads(path.read_text())
    return tuple(Earthquake(**{**row, "arrival": datetime.fromisoformat(row["arrival"])}) for row in rows)


def remember(folder: Path, earthquakes: Sequence[Earthquake]) -> None:
    """Write the earthquakes down, all or none of them."""
    rows = [{**asdict(earthquake), "arrival": earthquake.arrival.isoformat()} for earthquake in earthquakes]
    fresh = folder / f"{FILE}.new"
    fresh.write_text(json.dumps(rows, indent=1))
    fresh.replace(folder / FILE)


def strike(held: Archive, earthquake: Earthquake, scenario: Scenario, motions: Sequence[GroundMotion]) -> None:
    """Record an earthquake."""
    motion = next(motion for motion in motions if motion.name == earthquake.motion)
    held.add(record(earthquake, motion, scenario, SEED), quakeml(earthquake, LATITUDE, LONGITUDE))


def one_more(
    folder: Path, earlier: Sequence[Earthquake], now: datetime, scenario: Scenario, motions: Sequence[GroundMotion]
) -> Earthquake:
    """An earthquake that the monitoring server has just finished recording; the folder remembers it."""
    names = [motion.name for motion in motions]
    rng = np.random.default_rng([SEED, len(earlier)])
    fresh = next_earthquake(len(earlier), now - RECORDED, scenario.next_peak, names, rng)
    remember(folder, (*earlier, fresh))
    return fresh


def until_next(earlier: Sequence[Earthquake], now: datetime, wanted: timedelta) -> timedelta:
    """How long to wait before one more earthquake: as wanted, or longer, so that no two records overlap."""
    latest = max(earthquake.arrival for earthquake in earlier)
    return max(wanted, latest + APART + RECORDED - now)
