"""From a file dropped into a folder until its result is in the database: the whole service, nothing left out.

    python benchmarks/latency.py

The poller and the worker run as `menshin up` runs them, with SQLite; the file holds 10 channels of 12,000 counts (a
record of `menshin demo`). Beside it stands what of that time is waiting by settings (the poll interval and the time
that a file must have been left alone), and what the analysis itself takes in this process.
"""

import tempfile
from datetime import UTC, datetime, timedelta
from pathlib import Path
from statistics import median
from threading import Event as Signal
from time import perf_counter, sleep

from obspy import Stream
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from service import roles
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.demo.earthquakes import Earthquake, recorded
from service.demo.scenario import BY_DESIGN, record
from service.demo.site import building_file, inventory
from service.settings import Settings

ROUNDS = 5
POLL_INTERVAL, SETTLE_TIME = 0.5, 0.0  # s
START = datetime(2026, 1, 1, tzinfo=UTC)


def dropped(folder: Path, number: int) -> None:
    """One more earthquake's miniSEED file in the folder, whole from its first moment on."""
    motion = recorded()[0]
    earthquake = Earthquake(number, START + timedelta(days=number), motion.name, 0.7, 5e4)
    part = folder.parent / f"{number}.part"
    Stream(record(earthquake, motion, BY_DESIGN, 1)).write(str(part), format="MSEED")
    part.rename(folder / f"{number}.mseed")


def analysed(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return session.scalar(select(func.count()).select_from(Analysis)) or 0


def waited(sessions: sessionmaker[Session], count: int) -> None:
    while analysed(sessions) < count:
        sleep(0.01)


def main() -> None:
    with tempfile.TemporaryDirectory() as place:
        records = Path(place) / "records"
        records.mkdir()
        inventory().write(str(records / "station.xml"), format="STATIONXML")
        url = f"sqlite:///{place}/menshin.sqlite"
        settings = Settings(
            database_url=url, poll_interval=POLL_INTERVAL, settle_time=SETTLE_TIME, event_grace=0.0, workers=1
        )
        text = building_file("").replace('"fdsnws"', '"folder"').replace('location = ""', f'location = "{records}"')
        stop, took = Signal(), []
        with roles.migrated(settings) as sessions:
            with sessions.begin() as session:
                building_store.add(session, text, Path(place), START)
            with roles.running(settings, stop, poll=True, work=True):
                for number in range(ROUNDS + 1):
                    dropped(records, number)
                    begin = perf_counter()
                    waited(sessions, number + 1)
                    took.append(perf_counter() - begin)
            print(f"first event, the worker process started for it: {took[0]:.2f} s")
            print(
                f"median of the next {ROUNDS}: {median(took[1:]):.2f} s, of which up to {POLL_INTERVAL} s are polling"
            )


if __name__ == "__main__":
    main()
