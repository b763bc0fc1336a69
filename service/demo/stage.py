"""The demonstration's simulated world, as it stands when the service begins to watch it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from service.demo import memory
from service.demo.archive import Archive
from service.demo.catalogue import Earthquake
from service.demo.motions import GroundMotion
from service.demo.scenario import Scenario
from service.demo.site import inventory

DATABASE, BUILDING = "menshin.sqlite", "building.toml"
RECORDS, STATION = "records", "station.xml"
"""Folder of the records as files, and the file that describes their channels."""


@dataclass(slots=True, eq=False)
class Stage:
    """Ground motions, earthquakes so far and the monitoring server's archive; it goes on as time goes on."""

    folder: Path
    scenario: Scenario
    motions: Sequence[GroundMotion]
    earthquakes: Sequence[Earthquake]
    archive: Archive

    def strike(self, now: datetime) -> Earthquake:
        """One more earthquake, of which the record is complete now."""
        fresh = memory.one_more(self.folder, self.earthquakes, now, self.scenario, self.motions)
        memory.strike(self.archive, fresh, self.scenario, self.motions)
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
    """All earthquakes of the past; those that the folder remembers happen the same again.

    Args:
        folder: where everything is kept; made if it is missing.
        scenario: which building, and how strong its earthquakes are.
        motions: what the earthquakes are made of.
        count: earthquakes, where the folder remembers none.
        now: aware; the past ends here.
        done: called with how many of how many earthquakes are done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    earthquakes = memory.remembered(folder, now, count, scenario, motions)
    archive = Archive(inventory(scenario.sensors))
    for number, earthquake in enumerate(earthquakes, start=1):
        memory.strike(archive, earthquake, scenario, motions)
        done(number, len(earthquakes))
    return Stage(folder, scenario, motions, earthquakes, archive)


def forget(folder: Path) -> None:
    """Remove what a demonstration leaves in its folder, and nothing else."""
    for name in (DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm", BUILDING, memory.FILE):
        (folder / name).unlink(missing_ok=True)
    records = folder / RECORDS
    for file in (*records.glob("[0-9]*.mseed"), records / STATION):
        file.unlink(missing_ok=True)
    if records.is_dir() and not any(records.iterdir()):
        records.rmdir()
