"""Seconds and SQL statements of the service's work with many buildings of 60 analysed earthquakes each.

    OMP_NUM_THREADS=1 python -m benchmarks.scale [BUILDINGS ...] [--postgresql] [--only PART]

A database of so many buildings is made in a temporary folder (`benchmarks/city.py`). Seconds are of processor time of
this process unless they are said to be of the clock; the time of a PostgreSQL server is not in them. After an answer it
is given by itself, in steps of 10 ms divided by the number of requests.
"""

import gc
import multiprocessing
import multiprocessing.synchronize
import re
import shutil
import tempfile
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler
from multiprocessing.queues import Queue
from pathlib import Path
from threading import Event as Signal, Thread
from time import perf_counter, process_time, sleep
from typing import Annotated, Any

import numpy as np
import typer
from fastapi import FastAPI
from fastapi.testclient import TestClient
from sqlalchemy import Engine, event, func, select, update
from sqlalchemy.orm import Session, sessionmaker

warnings.simplefilter("ignore")

from benchmarks import city  # noqa: E402
from benchmarks.pages import LOCAL, more_events  # noqa: E402
from service.access.auth import Caller, Role  # noqa: E402
from service.alerts import building_states, checked_buildings  # noqa: E402
from service.alerts.checked_buildings import Checked, Known  # noqa: E402
from service.alerts.periodic_checks import check_buildings  # noqa: E402
from service.analyses.tables import Analysis  # noqa: E402
from service.db import migrate, sessions as database  # noqa: E402
from service.drift import monitoring  # noqa: E402
from service.jobs.queue import WATCH, Claim  # noqa: E402
from service.jobs.tables import Job  # noqa: E402
from service.poller import Poller  # noqa: E402
from service.records.tables import Event, SourceState  # noqa: E402
from service.serving import loaded  # noqa: E402
from service.settings import Settings  # noqa: E402
from service.verdict import levels  # noqa: E402

SIZES = (10, 100, 1_000)
HISTORIES = (10, 60, 300)
REQUESTS = 6
"""Of each address, each about another building."""
PORT = 48_123
"""Port of the monitoring server, fixed because kept databases name it."""
PARTS = ("round", "poller", "pages", "api", "drift")


@dataclass(frozen=True, slots=True)
class Taken:
    """Time and statements of one measurement."""

    name: str
    seconds: float
    statements: float
    note: str = ""

    def __str__(self) -> str:
        return f"    {self.name:58} {1e3 * self.seconds:11.1f} ms {self.statements:9.0f} statements  {self.note}"


class Quiet(BaseHTTPRequestHandler):
    """A monitoring server with nothing new."""

    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        """An empty list, or that it is the same as before."""
        is_known = self.headers.get("If-None-Match") == '"1"'
        self.send_response(304 if is_known else 200)
        self.send_header("ETag", '"1"')
        self.send_header("Content-Length", "0" if is_known else "2")
        self.send_header("Content-Type", "application/json")
        self.end_headers()
        if not is_known:
            self.wfile.write(b"[]")

    def log_message(self, *_: object) -> None:
        """No log."""


@contextmanager
def counting(engine: Engine) -> Iterator[list[str]]:
    """The statements since then."""
    statements: list[str] = []

    def note(*given: Any) -> None:  # noqa: ANN401  SQLAlchemy's
        statements.append(given[2])

    event.listen(engine, "before_cursor_execute", note)
    yield statements
    event.remove(engine, "before_cursor_execute", note)


def of_round(url: str, count: int) -> Iterator[Taken]:
    """A round of the periodic checks by a poller that starts, and one without news.

    The checks before are those of quiet buildings, stored here as they are: the first rounds ever check each building
    by itself, which `benchmarks/rounds.py` does.
    """
    sessions, settings, now = database.sessions(url), Settings(disk_reserve=0), datetime.now(UTC)
    with sessions.begin() as session:
        states = building_states.read(session, timedelta(days=7), now)
        later = now + timedelta(hours=6)
        checks = {
            number: Checked(now, one, Known(True, False, one.created_at, ()), {}, (), later, is_settled=True)
            for number, one in states.items()
        }
        numbers = list(checks)
        for first in range(0, len(numbers), levels.TOGETHER):
            some = numbers[first : first + levels.TOGETHER]
            checked_buildings.store(session, {one: checks[one] for one in some}, settings)
    last: dict[int, Checked] = {}
    for name in ("first round of a poller that starts", "round without news"):
        with counting(sessions.kw["bind"]) as statements:
            before, clock = process_time(), perf_counter()
            check_buildings(sessions, settings, now + timedelta(minutes=1), last=last)
            seconds, waited = process_time() - before, perf_counter() - clock
        yield Taken(name, seconds, len(statements), f"{waited:.1f} s of the clock")
    sessions.kw["bind"].dispose()


class Looking(Poller):
    """A poller without the periodic checks, which are measured by themselves."""

    def _check(self, stopped: Callable[[], bool]) -> None:
        """Nothing."""


def of_poller(url: str, count: int) -> Iterator[Taken]:
    """Polls of all sources by one poller, which has seen them before, and by two processes that share them."""
    sessions = database.sessions(url)
    for name in ("one poller polls every source", "again, nothing new"):
        begun, clock, before = datetime.now(UTC), perf_counter(), process_time()
        stop = Signal()
        with counting(sessions.kw["bind"]) as statements:
            running = Thread(target=Looking(sessions, polling(url)).run, args=(stop,))
            running.start()
            _wait_for(sessions, begun, count)
            seconds, waited = process_time() - before, perf_counter() - clock
            looked = _looked(sessions, begun)
            stop.set()
            running.join()
        yield Taken(name, seconds, len(statements), f"{waited:.1f} s of the clock; {looked} polled")
    yield _shared(url, sessions, count)
    sessions.kw["bind"].dispose()


def polling(url: str) -> Settings:
    """Settings of a poller that polls each source once."""
    return Settings(database_url=url, poll_interval=3600.0, disk_reserve=0)


def _shared(url: str, sessions: sessionmaker[Session], count: int) -> Taken:
    """Polls by two processes, from when both poll their share."""
    context = multiprocessing.get_context("spawn")
    stop, times = context.Event(), context.Queue()
    pollers = [context.Process(target=_poll, args=(url, stop, times)) for _ in range(2)]
    for one in pollers:
        one.start()
    for _ in pollers:
        times.get()
    begun, clock = datetime.now(UTC), perf_counter()
    _wait_for(sessions, begun, count)
    waited, looked = perf_counter() - clock, _looked(sessions, begun)
    stop.set()
    spent = [times.get() for _ in pollers]
    for one in pollers:
        one.join()
    shares = " and ".join(f"{seconds:.1f} s" for seconds in spent)
    return Taken("two pollers share them", sum(spent), 0, f"{waited:.1f} s of the clock; {looked} polled; {shares}")


def _poll(url: str, stop: multiprocessing.synchronize.Event, times: "Queue[float]") -> None:
    """Run a poller in this process: send a message when it is ready, and its processor time since then at the end."""
    sessions = database.sessions(url)
    times.put(0.0)
    before, ending = process_time(), Signal()
    running = Thread(target=Looking(sessions, polling(url)).run, args=(ending,))
    running.start()
    stop.wait()
    spent = process_time() - before
    ending.set()
    running.join()
    times.put(spent)


def _wait_for(sessions: sessionmaker[Session], begun: datetime, count: int) -> None:
    """Wait until every source has been polled since then, half an hour at most."""
    clock = perf_counter()
    while _looked(sessions, begun) < count and perf_counter() - clock < 1800.0:
        sleep(1.0)


def _looked(sessions: sessionmaker[Session], begun: datetime) -> int:
    with database.reading(sessions)() as session:
        return session.scalar(select(func.count()).where(SourceState.succeeded_at >= begun)) or 0


VALUES: Mapping[str, object] = {"form": "svg", "name": "friction", "service": "station", "year": 2026}
QUERY: Mapping[str, str] = {
    "/api/v1/buildings/{code}/baseline": "quantity=stiffness&subject=x",
    "/api/v1/buildings/{code}/baseline/observations": "quantity=stiffness&subject=x",
    "/api/v1/events/{event_id}/restoring-force": "direction=x",
}
MORE = {
    "first page": "/",
    "first page, second page of it": "/?number=2",
    "first page, searched": "/?find=B9",
    "first page, of a level": "/?level=inspect",
    "page of a building": "/buildings/{code}",
    "page of its events": "/buildings/{code}/events",
    "page of its drift": "/buildings/{code}/drift",
    "page of its alerts": "/buildings/{code}/alerts",
    "page of its messages": "/buildings/{code}/messages",
    "page of its files": "/buildings/{code}/recordings",
    "page of its models": "/buildings/{code}/models",
    "page of its modes": "/modes?building={code}",
    "page of an event": "/events/{event_id}",
    "keys": "/keys",
    "metrics": "/metrics",
    "readiness": "/readyz",
    "FDSN stations: one": "/fdsnws/station/1/query?sta={code}&level=channel",
    "FDSN stations: one by place and name": "/fdsnws/station/1/query?sta={code}&minlat=30&maxlat=40",
    "FDSN stations: all, level=station": "/fdsnws/station/1/query?level=station&format=text",
    "FDSN dataselect: one channel, a day": "/fdsnws/dataselect/1/query?sta={code}&start={day}&end={day}T23:59:59",
}
LEFT_OUT = ("pdf", "progress", "/report.html", "/reports/", "openapi", "docs")


def application(url: str) -> FastAPI:
    """The application as the server of the API starts it."""
    app: FastAPI = loaded().create(Settings(database_url=url), Caller("reader", Role.admin))
    gc.freeze()
    return app


def of_pages(url: str, count: int) -> Iterator[Taken]:
    """Pages, metrics, readiness and FDSN answers."""
    app = application(url)
    yield from answers(app, MORE, count)


def of_api(url: str, count: int) -> Iterator[Taken]:
    """Every answer of the API that reads."""
    app = application(url)
    yield from answers(app, {path: path for path in sorted(app.openapi()["paths"]) if _is_read(app, path)}, count)


def answers(app: FastAPI, paths: Mapping[str, str], count: int) -> Iterator[Taken]:
    """Answers about one building each; p95 of the clock, and the mean of the server's processor time, in the note."""
    sessions = app.state.sessions
    address = sessions.kw["bind"].url
    is_served = address.get_backend_name() == "postgresql"
    server = city.server_process(address.render_as_string(hide_password=False)) if is_served else None
    with sessions() as session:
        stride = session.scalar(select(func.count(Event.id)).where(Event.building_id == 1)) or 0
        day = session.scalar(select(func.max(Event.start)).where(Event.building_id == 1))
    assert day is not None
    with TestClient(app, base_url=LOCAL, client=("127.0.0.1", 50_000)) as client:
        for name, path in paths.items():
            clock, cpu, statuses, numbers, size, served = [], [], set(), [], 0, 0.0
            for number in range(REQUESTS):
                if number == 1 and server is not None:
                    served = city.processor_time(server)
                of = (number * 7919) % count
                given = defaultdict(lambda: 1, VALUES) | {
                    "code": f"B{of}" if of else "DEMO",
                    "event_id": 1 + of * stride,
                    "channel": f"XX.{f'B{of}' if of else 'DEMO'}.01.HNX",
                    "day": f"{day:%Y-%m-%d}",
                }
                address = path.format_map(given)
                address += "?" + QUERY[path] if path in QUERY else ""
                with counting(sessions.kw["bind"]) as statements:
                    begun, before = perf_counter(), process_time()
                    answer = client.get(address)
                    cpu.append(process_time() - before)
                    clock.append(perf_counter() - begun)
                statuses.add(answer.status_code)
                numbers.append(len([one for one in statements if not re.match("BEGIN", one)]))
                size = max(size, len(answer.content))
            found = ",".join(map(str, sorted(statuses)))
            p95 = f"p95 {1e3 * float(np.quantile(clock[1:], 0.95)):.0f} ms of the clock, {size / 1e3:.0f} kB, {found}"
            if server is not None:
                p95 += f", {1e3 * (city.processor_time(server) - served) / (REQUESTS - 1):.0f} ms of the server"
            yield Taken(name, float(np.quantile(cpu[1:], 0.95)), max(numbers[1:]), p95)


def _is_read(app: FastAPI, path: str) -> bool:
    return "get" in app.openapi()["paths"][path] and not any(one in path for one in LEFT_OUT)


def of_drift(folder: Path) -> Iterator[Taken]:
    """Bringing the drift of one building up to date after its last earthquake, with longer and longer histories."""
    first = folder / "first.sqlite"
    migrate.upgrade(f"sqlite:///{first}")
    sessions = database.sessions(f"sqlite:///{first}")
    city.analysed(sessions, city.NOWHERE, datetime.now(UTC))
    sessions.kw["bind"].dispose()
    for earthquakes in HISTORIES:
        file = folder / f"{earthquakes}.sqlite"
        shutil.copyfile(first, file)
        yield from _after(f"sqlite:///{file}", earthquakes)


def _after(url: str, earthquakes: int) -> Iterator[Taken]:
    sessions = database.sessions(url)
    more_events(sessions.kw["bind"], earthquakes + 1)
    _show_last(sessions, is_shown=False)
    _monitored(sessions)
    _show_last(sessions, is_shown=True)
    for name, seconds, statements in _monitored(sessions):
        yield Taken(f"drift after {earthquakes} earthquakes: {name}", seconds, statements)
    sessions.kw["bind"].dispose()


def _show_last(sessions: sessionmaker[Session], *, is_shown: bool) -> None:
    """Give the last earthquake its analysis, or take it away."""
    with sessions.begin() as session:
        last = select(Event.id).order_by(Event.start.desc()).limit(1).scalar_subquery()
        session.execute(update(Analysis).where(Analysis.event_id == last).values(current=is_shown))


def _monitored(sessions: sessionmaker[Session]) -> list[tuple[str, float, int]]:
    """(step, s, statements) of one monitoring of the building."""
    now, engine = datetime.now(UTC), sessions.kw["bind"]
    with sessions.begin() as session:
        job = Job(kind=WATCH, building_id=1, arguments={}, state="running", claims=1, created_at=now)
        session.add(job)
        session.flush()
        claim = Claim(job.id, WATCH, None, None, 1, {}, 1, 0)
    steps = []
    with counting(engine) as statements, sessions() as session:
        before = process_time()
        given = monitoring.inputs(session, claim, Settings())
        steps.append(("read", process_time() - before, len(statements)))
    before = process_time()
    found = monitoring.monitored(given.series_inputs)
    steps.append(("computed", process_time() - before, 0))
    with counting(engine) as statements:
        before = process_time()
        with sessions.begin() as session:
            monitoring.store(session, claim, given, [found], now)
        steps.append(("stored", process_time() - before, len(statements)))
    return steps


def main(
    buildings: Annotated[list[int] | None, typer.Argument(help="Numbers of buildings.")] = None,
    postgresql: Annotated[bool, typer.Option(help="On PostgreSQL; otherwise on SQLite.")] = False,
    earthquakes: Annotated[int, typer.Option(help="Analysed earthquakes of each building.")] = 60,
    only: Annotated[list[str] | None, typer.Option(help=f"Parts: {', '.join(PARTS)}.")] = None,
    keep: Annotated[Path | None, typer.Option(help="Folder of SQLite files to use again, and to leave.")] = None,
) -> None:
    """Lines of time and statements for each number of buildings."""
    parts = only or list(PARTS)
    measures = {"round": of_round, "poller": of_poller, "pages": of_pages, "api": of_api}
    for count in buildings or SIZES:
        with ExitStack() as stack:
            folder = keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
            if not measures.keys().isdisjoint(parts):
                source, begun = stack.enter_context(city.monitoring_server(Quiet, PORT)), process_time()
                file = folder / f"{count}.sqlite"
                url = stack.enter_context(city.server()) if postgresql else f"sqlite:///{file}"
                if postgresql or not file.exists():
                    city.build(url, count, earthquakes)
                migrate.upgrade(url)
                city.move(url, source)
                where = "PostgreSQL" if postgresql else "SQLite"
                print(f"{count} buildings on {where} ({process_time() - begun:.0f} s to make)", flush=True)
            for name in (one for one in parts if one in measures):
                for taken in measures[name](url, count):
                    print(taken, flush=True)
    if "drift" in parts:
        with tempfile.TemporaryDirectory() as place:
            for taken in of_drift(Path(place)):
                print(taken, flush=True)


if __name__ == "__main__":
    typer.run(main)
