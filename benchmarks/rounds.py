"""The periodic checks of idle buildings: processor time and SQL statements of a round without news.

    python benchmarks/rounds.py [BUILDINGS ...]

Every building has 60 analysed earthquakes, their files, a source that answers, an active alert with its message, and a
recipient; nothing is due. The database is an SQLite file. The first rounds, which write what a building lacks and learn
its state, are not counted; the time is the median of five rounds.
"""

import tempfile
from argparse import ArgumentParser
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

from sqlalchemy import event, insert
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.checked_buildings import Checked
from service.alerts.periodic_checks import check_buildings
from service.alerts.tables import Alert, AlertChange
from service.buildings import description
from service.buildings.tables import Building, Revision
from service.db import migrate, sessions as database
from service.db.base import Base
from service.notify.tables import Receiver
from service.records.tables import Event, Recording, SourceState
from service.settings import Settings

SIZES, EVENTS, ROUNDS = (100, 1_000, 10_000), 60, 5
NOW, MINUTE, DAY = datetime(2026, 1, 1, tzinfo=UTC), timedelta(minutes=1), timedelta(days=1)
FILE = """
code = "B"
name = "tower"
[source]
kind = "archive"
location = "http://127.0.0.1/events/"
data = "events"
[[level]]
name = "ground"
role = "ground"
[[level]]
name = "base"
role = "base"
mass = 1e6
[[level]]
name = "roof"
role = "floor"
mass = 1e6
[isolation]
[[channel]]
id = "XX.B.00.HNX"
level = "ground"
direction = "x"
quantity = "acceleration"
[[channel]]
id = "XX.B.01.HNX"
level = "base"
direction = "x"
quantity = "acceleration"
"""


def add_buildings(session: Session, count: int) -> None:
    """Buildings without anything that is due."""
    parsed, numbers = description.stored(FILE), range(1, count + 1)
    _insert(
        session, Building, ({"id": n, "code": f"B{n}", "name": "tower", "created_at": NOW - 90 * DAY} for n in numbers)
    )
    of_file = {"number": 1, "toml": FILE, "parsed": parsed, "folder": "/", "created_at": NOW - 90 * DAY}
    _insert(session, Revision, ({"building_id": n, **of_file} for n in numbers))
    polled = {"cursor": {}, "attempted_at": NOW, "looked_at": NOW, "succeeded_at": NOW, "clock_ahead": 0.0}
    _insert(session, SourceState, ({"building_id": n, **polled} for n in numbers))
    _insert(session, Event, (_event(n, day) for n in numbers for day in range(EVENTS)))
    _insert(session, Recording, (_recording(n, day) for n in numbers for day in range(EVENTS)))
    _insert(session, Receiver, (receiver(n) for n in numbers))
    _insert(session, Alert, (open_alert(n) for n in numbers))
    change = {"at": NOW - DAY, "state": "active", "note": "softer", "summary": "softer", "evidence": {}}
    _insert(session, AlertChange, ({"alert_id": n, **change} for n in numbers))


def _insert(session: Session, table: type[Base], rows: Iterator[dict[str, Any]]) -> None:
    session.execute(insert(table), list(rows))


def _event(building: int, day: int) -> dict[str, Any]:
    start = NOW - (3 + day) * DAY
    end = start + MINUTE
    times = {"start": start, "end": end, "created_at": end, "updated_at": end}
    return {"id": (building - 1) * EVENTS + day + 1, "building_id": building, "state": "analysed", **times}


def _recording(building: int, day: int) -> dict[str, Any]:
    start = NOW - (3 + day) * DAY
    times = {"start": start, "end": start + MINUTE, "received_at": start + MINUTE}
    return {"building_id": building, "name": f"{day}", "origin": "", "kind": "waveforms", "state": "read", **times}


def receiver(building: int) -> dict[str, Any]:
    wanted = {"kinds": ["alert", "data"], "severities": ["alarm", "warning", "note"]}
    origin = {"origin": "api", "created_by": "Jo", "created_at": NOW - 90 * DAY}
    return {"building_id": building, "name": "manager", "kind": "email", "address": "m@example.org", **wanted, **origin}


def open_alert(building: int) -> dict[str, Any]:
    event = (building - 1) * EVENTS + 1
    times = {"began_at": NOW - 3 * DAY, "opened_at": NOW - 2 * DAY, "updated_at": NOW - DAY, "activated_at": NOW - DAY}
    events = {"onset_event_id": event, "raised_event_id": event, "event_ids": [event], "channels": []}
    words = {"evidence": {"rule": "step", "drift": -0.08}, "summary": "It is softer", "sentences": ["It is softer."]}
    return {"building_id": building, "cause": "stiffness/x", "kind": "deterioration", "state": "active"} | (
        {**times, **events, **words}
    )


def idle_round(sessions: sessionmaker[Session], begin: datetime = NOW) -> tuple[float, int]:
    """Processor seconds and SQL statements of a round without news."""
    settings, last, statements, seconds = Settings(disk_reserve=0), dict[int, Checked](), list[str](), []
    for number in range(3):
        check_buildings(sessions, settings, begin + number * MINUTE, last=last)
    event.listen(sessions.kw["bind"], "before_cursor_execute", lambda *given: statements.append(given[2]))
    for number in range(3, 3 + ROUNDS):
        begun = process_time()
        check_buildings(sessions, settings, begin + number * MINUTE, last=last)
        seconds.append(process_time() - begun)
    return median(seconds), len(statements) // ROUNDS


def main() -> None:
    """A line for each number of buildings."""
    parser = ArgumentParser(description="Processor time of a round of periodic checks without news.")
    parser.add_argument("buildings", nargs="*", type=int, help=f"numbers of buildings; {SIZES} if none is given")
    for count in parser.parse_args().buildings or SIZES:
        with tempfile.TemporaryDirectory() as folder:
            url = f"sqlite:///{Path(folder) / 'menshin.sqlite'}"
            migrate.upgrade(url)
            sessions = database.sessions(url)
            with sessions.begin() as session:
                add_buildings(session, count)
            seconds, statements = idle_round(sessions)
            sessions.kw["bind"].dispose()
        print(f"{count:6d} buildings: {seconds:8.3f} s, {statements} statements")


if __name__ == "__main__":
    main()
