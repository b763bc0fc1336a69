"""Checks of the installation itself: settings, database, disk, clock, the running processes."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic
from urllib.parse import urlsplit

import httpx
from platformdirs import user_cache_path
from sqlalchemy import func, make_url, select, text
from sqlalchemy.orm import Session, sessionmaker

from core.errors import ModelError
from service.addresses import is_loopback
from service.db import encryption, migrate
from service.db.problems import shown
from service.db.process_leases import NOTIFYING, has_passed
from service.db.sessions import free_bytes
from service.doctor.findings import Found, good, note, wrong
from service.errors import StoreAwayError
from service.health import readiness
from service.jobs.tables import Lease
from service.notify.housekeeping import LEASE
from service.records import originals
from service.records.file_store import LostFileError, store_of
from service.records.tables import Content, SourceState
from service.settings import Settings, old_names, settings_file, unknown_variables
from service.user_effects import add_user_effects

MIB, GB = 2**20, 1e9
TEMPORARY = 500 * MIB
"""Bytes that the folder of temporary files should have free: the parser's and the workers' files. Not tuned."""
CROWDED = 0.9
"""Fraction of a server's connections in use from which on it is noted. Not tuned."""
NTP = "synchronise all machines with a time server (NTP)"
DURABLE = ("fsync", "full_page_writes", "synchronous_commit")
"""Settings of a PostgreSQL server; with one of them off, a crash loses what was committed, or damages the database."""
SAMPLE = 3
"""Original files that are read as a sample; `menshin storage check` reads all."""
LOCKED = 3
"""s for which the database may be in use by another writer."""


def of_settings(settings: Settings) -> Iterator[Found]:
    """Names that are no settings, the secret key, effects of your own, and the address of the pages."""
    file = settings_file()
    for line in unknown_variables(os.environ):
        yield note(line, "correct the name, or remove the variable")
    for line in old_names(os.environ, file):
        yield note(line, "use the new name; a later version no longer reads the old one")
    encryption.is_key_set()
    try:
        add_user_effects(settings.effects_folder)
    except ModelError as error:
        yield wrong(str(error).rstrip("."), "correct or remove the file in effects_folder")
    public = urlsplit(settings.public_url or "")
    if not public.hostname:
        yield note("public_url is not set: messages have no links", "set public_url to the address of the pages")
    elif public.scheme != "https" and not is_loopback(public.hostname):
        yield note(
            f"{settings.public_url} is not encrypted: keys and passwords can be read in transit",
            "put a proxy with TLS before the service (docs/operate/security.md)",
        )
    yield good(
        f"the settings can be read, from {'the environment alone' if file is None else f'{file} and the environment'}"
    )


def of_database(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """The database answers, has the tables of this version, and can be written."""
    name = shown(make_url(settings.database_url))
    with sessions() as session:
        if session.get_bind().dialect.name == "postgresql":
            session.execute(text(f"SET LOCAL lock_timeout = '{LOCKED}s'"))
        if not migrate.is_newest(session):
            yield wrong(
                f"the tables of {name} are not those of this version",
                "stop all processes of the earlier version, back up the database, then start this version, which "
                "upgrades the tables; if a newer version was here, run that version",
            )
            return
        session.execute(text("UPDATE alembic_version SET version_num = version_num"))
        session.rollback()
        yield good(f"{name} answers, can be written, and has this version's tables")
        if session.get_bind().dialect.name == "postgresql":
            yield from _server(session)


def _server(session: Session) -> Iterator[Found]:
    """Durability, connections and blocked sessions of a PostgreSQL server."""
    if off := [name for name in DURABLE if session.scalar(select(func.current_setting(name))) == "off"]:
        yield note(
            f"the database's server has {' and '.join(off)} off: a crash can lose records and send messages twice",
            "set it to on" if len(off) == 1 else "set them to on",
        )
    used, most = session.execute(
        text("SELECT (SELECT count(*) FROM pg_stat_activity), current_setting('max_connections')::int")
    ).one()
    if used > CROWDED * most:
        yield note(
            f"{used} of the server's {most} connections are in use",
            "raise its max_connections, or run fewer processes of the service",
        )
    blocked = session.scalar(
        text(
            "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() "
            "AND cardinality(pg_blocking_pids(pid)) > 0 AND query_start < now() - interval '10 seconds'"
        )
    )
    if blocked:
        yield wrong(
            f"{blocked} statements have waited more than 10 s for others to end",
            "see pg_stat_activity and pg_blocking_pids of the server, and end the session that blocks them",
        )


def of_disk(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """Room for the database, temporary files and kept analyses."""
    with sessions() as session:
        free = free_bytes(session)
    reserve = settings.data_health.disk_reserve
    if free is None:
        yield good("the database is on a server, whose disk cannot be examined from here")
    elif free < reserve:
        yield wrong(
            f"{free / MIB:.0f} MiB are free on the disk of the database, {reserve / MIB:.0f} MiB should be",
            "free some space, give the database a larger disk, or run `menshin prune`",
        )
    else:
        yield good(f"{free / GB:.1f} GB are free on the disk of the database")
    temporary = shutil.disk_usage(tempfile.gettempdir()).free
    if temporary < TEMPORARY:
        yield note(
            f"{temporary / MIB:.0f} MiB are free for temporary files in {tempfile.gettempdir()}",
            f"give it {TEMPORARY / MIB:.0f} MiB, or name another folder in TMPDIR",
        )
    kept = _existing(user_cache_path("menshin"))
    if shutil.disk_usage(kept).free < settings.jobs.kept_room * GB:
        yield note(
            f"less than jobs.kept_room = {settings.jobs.kept_room:g} GB are free at {kept}",
            "free some space, or set a smaller jobs.kept_room",
        )


def of_storage(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """The store of original files can be reached and written, has room, and is the one that the database needs."""
    with sessions() as session:
        outside = originals.outside(session)
        sample = session.scalars(select(Content.sha256).where(Content.is_outside, originals.is_there()).limit(SAMPLE))
        store = store_of(settings.storage)
        if store is None:
            if outside.files:
                yield wrong(
                    f"{outside.files} original files are outside the database, but storage.originals is not set",
                    "set it to the store that has them",
                )
            else:
                yield good("original files are in the database")
            return
        try:
            store.probe()
            yield good(f"{store.url} can be read and written, and has {outside.files} original files")
            if (free := store.free_bytes()) is not None and free < settings.data_health.disk_reserve:
                yield wrong(
                    f"{free / MIB:.0f} MiB are free at {store.url}, {settings.data_health.disk_reserve / MIB:.0f} MiB "
                    "should be",
                    "free some space there, or set retention.original_files and run `menshin prune`",
                )
            for digest in sample.all():
                store.get(digest)
        except (StoreAwayError, LostFileError) as error:
            sentence, _, helps = str(error).partition("; ")
            yield wrong(sentence, helps)


def _existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    return next(one for one in (folder, *folder.parents) if one.is_dir())


def of_clock(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """This machine's clock against the stored times, the database server's clock and those of the sources."""
    tolerance, now = timedelta(seconds=settings.data_health.clock_tolerance), datetime.now(UTC)
    with sessions() as session:
        stored = next(one for one in readiness.checks(session, settings, now) if one.name == "clock")
        yield good(f"{stored.found}, {now:%Y-%m-%d %H:%M:%S} UTC") if stored.ok else wrong(stored.found, stored.helps)
        if session.get_bind().dialect.name == "postgresql":
            yield _server_clock(session, tolerance)
        stated = session.scalars(select(SourceState.clock_ahead).where(SourceState.clock_ahead.is_not(None)))
        offsets = [timedelta(seconds=one) for one in stated if one is not None]
    if off := [one for one in offsets if abs(one) > tolerance]:
        yield wrong(
            f"the clocks of {len(off)} of {len(offsets)} monitoring servers differ; the worst is "
            f"{_offset(max(off, key=abs))} this machine's",
            NTP,
        )
    elif offsets:
        yield good(f"the clocks of {len(offsets)} monitoring servers show the same time")


def _server_clock(session: Session, tolerance: timedelta) -> Found:
    before = datetime.now(UTC)
    there = session.execute(select(func.clock_timestamp())).scalar_one()
    ahead = there - (before + (datetime.now(UTC) - before) / 2)
    if abs(ahead) > tolerance:
        return wrong(f"the clock of the database's server is {_offset(ahead)} this machine's", NTP)
    return good("the clock of the database's server shows the same time")


def _offset(ahead: timedelta) -> str:
    return f"{abs(ahead.total_seconds()):.0f} s {'ahead of' if ahead > timedelta(0) else 'behind'}"


def of_poller(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """A poller renews its lease and polls every source in time."""
    yield from _ready(settings, sessions, "poller", "looks")


def of_worker(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """A worker renews its lease, and no work waits for too long."""
    yield from _ready(settings, sessions, "worker")


def _ready(settings: Settings, sessions: sessionmaker[Session], *names: str) -> Iterator[Found]:
    with sessions() as session:
        for one in readiness.checks(session, settings, datetime.now(UTC)):
            if one.name in names:
                yield good(one.found) if one.ok else wrong(one.found, one.helps)


def of_notifier(settings: Settings, sessions: sessionmaker[Session]) -> Iterator[Found]:
    """A notifier renews its lease, and somebody outside would miss it."""
    with sessions() as session:
        until = session.scalar(select(Lease.until).where(Lease.name == NOTIFYING))
    if until is None or has_passed(until, datetime.now(UTC), LEASE):
        yield wrong(
            "no notifier was seen lately",
            "'menshin notify' or 'menshin up' starts one; if one is running, see its log",
        )
    else:
        yield good("a notifier is running")
    if settings.heartbeat.url is None:
        yield note(
            "nobody outside notices when Menshin itself stops",
            "set heartbeat.url to a service that raises an alarm when the heartbeat stops (docs/operate/messages.md)",
        )


def of_api(settings: Settings, timeout: float) -> Iterator[Found]:
    """The API answers at the address of the settings."""
    host = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(settings.host, settings.host)
    address, begun = f"http://{host}:{settings.port}/healthz", monotonic()
    try:
        status = httpx.get(address, timeout=timeout, trust_env=False).status_code
    except httpx.HTTPError:
        status = None
    if status == httpx.codes.OK:
        yield good(f"the API answers at {address} after {1000 * (monotonic() - begun):.0f} ms")
        return
    yield note(
        f"no API answers at {address}",
        "'menshin api' or 'menshin up' starts one; it may also run in another container or on another machine",
    )
