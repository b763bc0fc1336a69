"""Seconds and SQL statements of the service's work with many buildings of 60 analysed earthquakes each.

    OMP_NUM_THREADS=1 python -m benchmarks.scale [BUILDINGS ...] [--postgresql] [--only PART]

A database of so many buildings is made in a temporary folder (`benchmarks/city.py`). Seconds are of processor time of
this process unless they are said to be of the clock; the time of a PostgreSQL server is not in them. After an answer it
is given by itself, in steps of 10 ms divided by the number of requests. Times of the clock of pages and answers are
those of one client alone, and of four at once (`--clients`): together they request each 40 times (`--requests`) from
`menshin api`, one after the other has been answered.
"""

import gc
import multiprocessing
import multiprocessing.synchronize
import re
import shutil
import tempfile
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from http.server import BaseHTTPRequestHandler
from multiprocessing.queues import Queue
from pathlib import Path
from threading import Event as Signal, Thread
from time import perf_counter, process_time, sleep
from typing import Annotated, Any

import httpx
import numpy as np
import psutil
import typer
from fastapi import FastAPI
from fastapi.testclient import TestClient
from sqlalchemy import Engine, event, func, select, update
from sqlalchemy.orm import Session, sessionmaker

warnings.simplefilter("ignore")

from benchmarks import city, commands  # noqa: E402
from benchmarks.pages import LOCAL, more_events  # noqa: E402
from core.arrays import Vector  # noqa: E402
from service.access import keys  # noqa: E402
from service.access.auth import Role  # noqa: E402
from service.alerts import building_states, checked_buildings  # noqa: E402
from service.alerts.checked_buildings import Checked, Known  # noqa: E402
from service.alerts.periodic_checks import check_buildings  # noqa: E402
from service.analyses.tables import Analysis  # noqa: E402
from service.db import migrate, sessions as database  # noqa: E402
from service.demo.server import free_port  # noqa: E402
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
REQUESTS = 5
"""Number of requests for each address one by one, each about another building."""
PORT = 48_123
"""Port of the monitoring server, fixed because kept databases name it."""
PARTS = ("round", "poller", "pages", "api", "drift")


@dataclass(frozen=True, slots=True)
class Load:
    """Requests for pages and answers."""

    clients: int
    """Number of clients, each with one request at a time."""
    requests: int
    """Number of requests for each address."""


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
    app: FastAPI = loaded().create(Settings(database_url=url))
    gc.freeze()
    return app


def of_pages(url: str, count: int, load: Load) -> Iterator[Taken]:
    """Pages, metrics, readiness and FDSN answers."""
    yield from answers(url, application(url), MORE, count, load)


def of_api(url: str, count: int, load: Load) -> Iterator[Taken]:
    """Every answer of the API that reads."""
    app = application(url)
    paths = {path: path for path in sorted(app.openapi()["paths"]) if _is_read(app, path)}
    yield from answers(url, app, paths, count, load)


def answers(url: str, app: FastAPI, paths: Mapping[str, str], count: int, load: Load) -> Iterator[Taken]:
    """Answers about one building each.

    Processor time and statements are those of requests one by one within this process. The times of the clock in the
    note are those of one client alone and of all at once, at `menshin api` in a process of its own.
    """
    is_served = app.state.sessions.kw["bind"].url.get_backend_name() == "postgresql"
    server, this = [city.server_process(url)] if is_served else [], psutil.Process()
    with served(url, app.state.sessions, load.clients) as clients, TestClient(app, base_url=LOCAL) as within:
        within.headers = clients[0].headers
        for name, path in paths.items():
            addresses = _addresses(app.state.sessions, path, count, load.requests + 1)
            cpu, numbers = one_by_one(within, app.state.sessions.kw["bind"], addresses[: REQUESTS + 1])
            first = clients[0].get(addresses[0])
            notes = [f"{len(first.content) / 1e3:.0f} kB"]
            for some in (clients[:1], clients):
                begun, busy, own = perf_counter(), commands.busy(), commands.used([this])
                of_server = commands.used(server)
                clock, statuses = at_once(some, addresses[1:])
                of_server, own = commands.used(server) - of_server, commands.used([this]) - own
                others = (commands.busy() - busy - own - of_server) / (perf_counter() - begun)
                half, most = 1e3 * np.quantile(clock, [0.5, 0.95])
                notes.append(f"{len(some)} at once: p50 {half:.0f} ms, p95 {most:.0f} ms, {statuses}")
                if server:
                    notes[-1] += f", {1e3 * of_server / clock.size:.0f} ms of the server"
                notes[-1] += f", all else used {max(others, 0.0):.1f} cores"
            yield Taken(name, float(np.quantile(cpu, 0.95)), max(numbers), "; ".join(notes))


def _addresses(sessions: sessionmaker[Session], path: str, count: int, requests: int) -> list[str]:
    """Addresses of one kind, each about another building."""
    with sessions() as session:
        stride = session.scalar(select(func.count(Event.id)).where(Event.building_id == 1)) or 0
        day = session.scalar(select(func.max(Event.start)).where(Event.building_id == 1))
    query = "?" + QUERY[path] if path in QUERY else ""
    found = []
    for number in range(requests):
        of = (number * 7919) % count
        code = f"B{of}" if of else "DEMO"
        own = {"code": code, "event_id": 1 + of * stride, "channel": f"XX.{code}.01.HNX", "day": f"{day:%Y-%m-%d}"}
        found.append(path.format_map(defaultdict(lambda: 1, VALUES) | own) + query)
    return found


def one_by_one(client: TestClient, engine: Engine, addresses: Sequence[str]) -> tuple[list[float], list[int]]:
    """s of processor time and number of statements of each request but the first."""
    spent, numbers = [], []
    for address in addresses:
        with counting(engine) as statements:
            before = process_time()
            client.get(address)
            spent.append(process_time() - before)
        numbers.append(len([one for one in statements if not re.match("BEGIN", one)]))
    return spent[1:], numbers[1:]


def at_once(clients: Sequence[httpx.Client], addresses: Sequence[str]) -> tuple[Vector, str]:
    """(requests,) s of the clock of each request where each client has one at a time, and the states of the answers."""

    def asked(number: int) -> list[tuple[float, int]]:
        found = []
        for address in addresses[number :: len(clients)]:
            begun = perf_counter()
            answer = clients[number].get(address)
            found.append((perf_counter() - begun, answer.status_code))
        return found

    with ThreadPoolExecutor(len(clients)) as pool:
        every = [one for found in pool.map(asked, range(len(clients))) for one in found]
    statuses = sorted({status for _, status in every})
    return np.array([seconds for seconds, _ in every]), ",".join(map(str, statuses))


@contextmanager
def served(url: str, sessions: sessionmaker[Session], count: int) -> Iterator[list[httpx.Client]]:
    """So many clients of `menshin api`, each with a key of its own; it answers."""
    port = free_port(0)
    with sessions.begin() as session:
        names = [f"client {port}/{number}" for number in range(count)]
        made = [keys.create(session, one, Role.admin, datetime.now(UTC)) for one in names]
    base = {"base_url": f"http://127.0.0.1:{port}", "timeout": 60.0, "trust_env": False}
    with commands.running(url, "api", PORT=str(port)), ExitStack() as stack:
        clients = [stack.enter_context(httpx.Client(headers={"X-API-Key": key}, **base)) for key in made]
        while not _answers(clients[0]):
            sleep(0.2)
        yield clients


def _answers(client: httpx.Client) -> bool:
    with suppress(httpx.TransportError):
        return client.get("/healthz").is_success
    return False


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
    clients: Annotated[int, typer.Option(help="Clients that request pages at the same time.")] = 4,
    requests: Annotated[int, typer.Option(help="Requests for each page, of all clients together.")] = 40,
) -> None:
    """Lines of time and statements for each number of buildings."""
    parts = only or list(PARTS)
    pages, api = (partial(one, load=Load(clients, requests)) for one in (of_pages, of_api))
    measures = {"round": of_round, "poller": of_poller, "pages": pages, "api": api}
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
