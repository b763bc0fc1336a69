"""The records of a great earthquake as they arrive: how many a second pollers take in.

    OMP_NUM_THREADS=1 python -m benchmarks.arrivals [BUILDINGS] [--pollers 1] [--pollers 2]

Each building has a source of its own on an HTTP server of this machine. All sources have one new file when the pollers
start: a record of `menshin demo` of ten channels at 100 samples a second, with the building's own station. `menshin
poll` fetches each file, stores it in a PostgreSQL server in a temporary folder, reads it, and puts its earthquake into
the queue; no worker runs. The exit code is 1 if a file was rejected or lost.
"""

from collections.abc import Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler
from io import BytesIO
from pathlib import Path
from time import perf_counter, sleep
from typing import Annotated

import psutil
import typer
from obspy import Stream
from sqlalchemy import Engine, func, select, text
from sqlalchemy.orm import Session, sessionmaker

from benchmarks import city, commands
from benchmarks.flood_parts import GREAT
from service.buildings import store as building_store
from service.db import migrate, sessions as database
from service.demo.earthquakes import Earthquake, recorded
from service.demo.scenario import BY_DESIGN, record
from service.demo.site import SENSORS
from service.records.tables import Event, Recording

NAME = "great.mseed"
"""Name of the new file of every building."""
SETTINGS = {"POLLING__SETTLE_TIME": "0", "EVENT__GRACE": "0", "POLLING__INTERVAL": "60"}
"""Settings of the pollers."""
LONGEST = 3600.0
"""s until a run is given up."""
RECORD = 512
"""Bytes of a miniSEED record."""
STATION = 8, 5
"""Place and length of the station's code in its header (SEED 2.4, fixed section of the data header)."""


@dataclass(frozen=True, slots=True)
class TakenIn:
    """The files of all buildings, taken in."""

    pollers: int
    count: int
    clock: float
    """s from the start of the pollers until the last earthquake was queued."""
    starting: float
    """s of it until the first files were read."""
    first: int
    """Number of files that were read by then."""
    start: float
    """s of processor time of the pollers and their processes until then, most of it for imports."""
    spent: float
    """s of processor time of the pollers and their processes since then."""
    server: float
    """s of processor time of the PostgreSQL server since then."""
    faults: tuple[str, ...]
    """Files that were rejected or lost."""

    def __str__(self) -> str:
        later = self.count - self.first
        rate = later / (self.clock - self.starting)
        each = 1e3 * (self.spent + self.server) / later
        return (
            f"{self.pollers} pollers, {self.count} buildings: all queued after {self.clock:.0f} s of the clock; the "
            f"first file read after {self.starting:.1f} s with {self.start:.1f} s of processor time, then {rate:.1f} "
            f"files a second; {each:.0f} ms of processor time for each, {1e3 * self.server / later:.0f} ms of it "
            "PostgreSQL's\n"
            f"    arithmetic, not measured: {GREAT} files in {GREAT / rate / 60:.1f} min"
        )


def great_record(day: datetime, peak: float = 0.7, silent: Collection[str] = ()) -> bytes:
    """The miniSEED of an earthquake.

    Args:
        day: when it reaches the building.
        peak: m/s², of the ground.
        silent: ids of channels that record zeros.
    """
    motion, written = recorded()[0], BytesIO()
    traces = Stream(record(Earthquake(2, day, motion.name, peak, 5e4), motion, BY_DESIGN, 2))
    for one in traces:
        if one.id in silent:
            one.data[:] = 0
    traces.write(written, format="MSEED", reclen=RECORD)
    return written.getvalue()


def of_station(template: bytes, code: str) -> bytes:
    """A record with the station of a building."""
    changed, (place, length) = bytearray(template), STATION
    for begin in range(place, len(template), RECORD):
        changed[begin : begin + length] = code.ljust(length).encode()
    return bytes(changed)


def sources(template: bytes) -> type[BaseHTTPRequestHandler]:
    """Answers of a server that has a folder for each building's code, with one file."""
    return city.folders(lambda _: [NAME], lambda code: of_station(template, code))


def described() -> str:
    """A building file with the gain of each channel: a station's file is not needed."""
    text = city.described(city.NOWHERE)
    for one in SENSORS:
        text = text.replace(f'id = "{one.id}"', f'id = "{one.id}"\ngain = {one.resolution!r}')
    return text


def prepare(url: str, count: int, source: str, now: datetime) -> None:
    """Fill a new database with buildings whose source has a new file."""
    migrate.upgrade(url)
    sessions = database.sessions(url)
    city.received(sessions, city.NOWHERE, now, now - timedelta(days=1))
    with sessions.begin() as session:
        building_store.update_description(session, described(), Path("/"), now)
    engine = sessions.kw["bind"]
    city.repeat(engine, count)
    give_sources(engine, source)
    engine.dispose()


def give_sources(engine: Engine, source: str) -> None:
    """Give each building the folder with its code on a server as its source."""
    with engine.begin() as connection:
        for column in ("toml", "parsed"):
            own = f"replace({column}, '{city.NOWHERE}', :source || building.code || '/')"
            moved = f"UPDATE revision SET {column} = {own} FROM building WHERE building.id = revision.building_id"
            connection.execute(text(moved), {"source": source})


def taken_in(url: str, pollers: int, count: int, day: datetime, server: psutil.Process) -> TakenIn:
    """Take in all files with so many pollers."""
    sessions = database.sessions(url)
    with ExitStack() as stack:
        clock = perf_counter()
        running = [stack.enter_context(commands.running(url, "poll", **SETTINGS)) for _ in range(pollers)]
        while not (first := read(sessions)) and perf_counter() - clock < LONGEST:
            sleep(0.1)
        starting, start, of_server = perf_counter() - clock, commands.used(running), city.processor_time(server)
        while queued(sessions, day) < count and perf_counter() - clock < LONGEST:
            sleep(0.2)
        clock, spent = perf_counter() - clock, commands.used(running) - start
        of_server = city.processor_time(server) - of_server
    with sessions() as session:
        faults = tuple(lost(session, count, day))
    sessions.kw["bind"].dispose()
    return TakenIn(pollers, count, clock, starting, first, start, spent, of_server, faults)


def read(sessions: sessionmaker[Session]) -> int:
    """Number of new files that were read."""
    with database.reading(sessions)() as session:
        return session.scalar(select(func.count()).where(Recording.name == NAME, Recording.state != "stored")) or 0


def queued(sessions: sessionmaker[Session], day: datetime) -> int:
    """Number of new earthquakes in the queue."""
    with database.reading(sessions)() as session:
        return session.scalar(select(func.count()).where(Event.start >= day, Event.state == "queued")) or 0


def lost(session: Session, count: int, day: datetime) -> Iterator[str]:
    """Files that were rejected, and earthquakes that are missing or too many."""
    of_state = select(Recording.state, func.count()).where(Recording.name == NAME).group_by(Recording.state)
    states = dict(session.execute(of_state).tuples().all())
    if states != {"read": count}:
        yield f"the files of {count} buildings are {states}"
    found = session.scalar(select(func.count(Event.building_id.distinct())).where(Event.start >= day))
    every = session.scalar(select(func.count(Event.id)).where(Event.start >= day))
    if (found, every) != (count, count):
        yield f"{found} buildings of {count} have {every} earthquakes"


def main(
    buildings: Annotated[int, typer.Argument(min=2, help="Number of buildings.")] = 100,
    pollers: Annotated[list[int] | None, typer.Option(help="Numbers of pollers, one run for each.")] = None,
) -> None:
    """A line for each number of pollers."""
    now = datetime.now(UTC).replace(microsecond=0)
    day, faults = now - timedelta(minutes=10), list[str]()
    with city.server() as url, city.monitoring_server(sources(great_record(day))) as source:
        prepare(url, buildings, source, now)
        server = city.server_process(url)
        for number in pollers or [1, 2]:
            copy = city.copied(url, f"arrivals_{number}")
            found = taken_in(copy, number, buildings, day - timedelta(minutes=5), server)
            print(found, flush=True)
            for fault in found.faults:
                print(f"    WRONG: {fault}", flush=True)
            faults += found.faults
    raise typer.Exit(1 if faults else 0)


if __name__ == "__main__":
    typer.run(main)
