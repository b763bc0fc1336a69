"""The simulated world: earthquakes stored in a folder, their records in the server's archive and in files."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from obspy import UTCDateTime

from service.demo.earthquakes import Earthquake, GroundMotion, history, next_earthquake, quakeml
from service.demo.scenario import Scenario, record
from service.demo.server import Archive
from service.demo.site import AFTER_ORIGIN, LATITUDE, LONGITUDE, inventory
from service.records.fdsn_query import Selection

FILE = "earthquakes.json"
SEED = 2006
RECORDED = timedelta(seconds=AFTER_ORIGIN)
"""Delay after which an earthquake's record is complete, whatever its duration."""
BETWEEN_RECORDS = timedelta(minutes=5)
"""Minimum time between the end of a record and the next earthquake."""


def remembered(
    folder: Path, now: datetime, count: int, scenario: Scenario, motions: Sequence[GroundMotion]
) -> tuple[Earthquake, ...]:
    """Earthquakes stored in the folder; in a new folder, new ones until now."""
    path = folder / FILE
    if not path.exists():
        names = [motion.name for motion in motions]
        remember(folder, history(now, count, scenario.peaks, names, np.random.default_rng(SEED)))
    rows = json.loads(path.read_text())
    return tuple(Earthquake(**{**row, "arrival": datetime.fromisoformat(row["arrival"])}) for row in rows)


def remember(folder: Path, earthquakes: Sequence[Earthquake]) -> None:
    """Store all earthquakes or none."""
    rows = [{**asdict(earthquake), "arrival": earthquake.arrival.isoformat()} for earthquake in earthquakes]
    fresh = folder / f"{FILE}.new"
    fresh.write_text(json.dumps(rows, indent=1))
    fresh.replace(folder / FILE)


def record_earthquake(
    archive: Archive, earthquake: Earthquake, scenario: Scenario, motions: Sequence[GroundMotion]
) -> None:
    """Add an earthquake's record to the archive."""
    motion = next(motion for motion in motions if motion.name == earthquake.motion)
    archive.add(record(earthquake, motion, scenario, SEED), quakeml(earthquake, LATITUDE, LONGITUDE))


def one_more(
    folder: Path, earlier: Sequence[Earthquake], now: datetime, scenario: Scenario, motions: Sequence[GroundMotion]
) -> Earthquake:
    """An earthquake whose recording has just ended; it is stored in the folder."""
    names = [motion.name for motion in motions]
    rng = np.random.default_rng([SEED, len(earlier)])
    fresh = next_earthquake(len(earlier), now - RECORDED, scenario.next_peak, names, rng)
    remember(folder, (*earlier, fresh))
    return fresh


def until_next(earlier: Sequence[Earthquake], now: datetime, wanted: timedelta) -> timedelta:
    """Time until the next earthquake: the given one, or longer so that records do not overlap."""
    latest = max(earthquake.arrival for earthquake in earlier)
    return max(wanted, latest + BETWEEN_RECORDS + RECORDED - now)


DATABASE, BUILDING = "menshin.sqlite", "building.toml"
RECORDS, STATION = "records", "station.xml"
"""Folder of the records as files, and the file that describes their channels."""


@dataclass(slots=True, eq=False)
class Stage:
    """Ground motions, past earthquakes and the monitoring server's archive, which grow with time."""

    folder: Path
    scenario: Scenario
    motions: Sequence[GroundMotion]
    earthquakes: Sequence[Earthquake]
    archive: Archive

    def strike(self, now: datetime) -> Earthquake:
        """Add an earthquake whose record is complete now."""
        fresh = one_more(self.folder, self.earthquakes, now, self.scenario, self.motions)
        record_earthquake(self.archive, fresh, self.scenario, self.motions)
        self.earthquakes = (*self.earthquakes, fresh)
        return fresh


def prepared(
    folder: Path,
    scenario: Scenario,
    motions: Sequence[GroundMotion],
    count: int,
    now: datetime,
    done: Callable[[int, int], None],
) -> Stage:
    """All past earthquakes; those stored in the folder are reproduced.

    Args:
        folder: where everything is kept; made if it is missing.
        scenario: which building, and how strong its earthquakes are.
        motions: what the earthquakes are made of.
        count: earthquakes, where the folder remembers none.
        now: aware; the past ends here.
        done: called with how many of how many earthquakes are done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    earthquakes = remembered(folder, now, count, scenario, motions)
    archive = Archive(inventory(scenario.sensors))
    for number, earthquake in enumerate(earthquakes, start=1):
        record_earthquake(archive, earthquake, scenario, motions)
        done(number, len(earthquakes))
    return Stage(folder, scenario, motions, earthquakes, archive)


def forget(folder: Path) -> None:
    """Remove the demonstration's files from its folder, and no others."""
    for name in (DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm", BUILDING, FILE):
        (folder / name).unlink(missing_ok=True)
    records = folder / RECORDS
    for file in (*records.glob("[0-9]*.mseed"), records / STATION):
        file.unlink(missing_ok=True)
    if records.is_dir() and not any(records.iterdir()):
        records.rmdir()


def write_records(stage: Stage) -> Path:
    """Write a miniSEED file for each earthquake, numbered in order of time, and StationXML; return the folder."""
    folder = stage.folder / RECORDS
    folder.mkdir(exist_ok=True)
    stage.archive.inventory.write(str(folder / STATION), format="STATIONXML", level="response")
    for number, earthquake in enumerate(stage.earthquakes, start=1):
        arrival = UTCDateTime(earthquake.arrival)
        around = Selection(start=arrival - RECORDED.total_seconds(), end=arrival + RECORDED.total_seconds())
        stage.archive.waveforms(around).write(str(folder / f"{number}.mseed"), format="MSEED")
    return folder
