"""The parts of the service that run together in one process tree, and their orderly end."""

import logging
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir
from threading import Event as Signal, Thread
from time import time
from types import FrameType
from typing import TYPE_CHECKING

from sqlalchemy import Text, func, make_url, not_, select, type_coerce
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import logs, tracing
from service.db import encryption, migrate
from service.db.problems import is_away
from service.db.sessions import sessions
from service.notify.tables import Receiver
from service.settings import Settings

if TYPE_CHECKING:
    from service.jobs.executors import Executors

log = logging.getLogger(__name__)

LOOK_UP = 0.5
"""s between two looks at a signal or the database."""
WORK_FOLDER = "menshin-work-"
LOCK = "owner.lock"
YOUNG = 60.0
"""s in which a new work folder may still be without a lock."""


@contextmanager
def migrated(settings: Settings) -> Iterator[sessionmaker[Session]]:
    """Sessions on the database, brought up to date first."""
    migrate.upgrade(settings.database_url)
    with _opened(settings) as opened:
        yield opened


@contextmanager
def _opened(settings: Settings) -> Iterator[sessionmaker[Session]]:
    opened = sessions(settings.database_url)
    try:
        yield opened
    finally:
        opened.kw["bind"].dispose()


@contextmanager
def stop_signal() -> Iterator[Signal]:
    """An event that SIGINT (Ctrl-C) or SIGTERM sets."""
    stop = Signal()

    def end(number: int, frame: FrameType | None) -> None:
        stop.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def wait_for(stop: Signal) -> None:
    """Wait until the event is set.

    It waits in short steps: signal handlers run in the main thread only, and a signal just before an endless wait was
    missed in practice.
    """
    while not stop.wait(LOOK_UP):
        pass


@contextmanager
def running(
    settings: Settings, stop: Signal, *, poll: bool = False, work: bool = False, notify: bool = False
) -> Iterator[sessionmaker[Session]]:
    """Run the parts as threads beside the caller's own work, and end them afterwards; yields sessions.

    No part starts if `stop` is set before the database answers.
    """
    logs.begin(logs.LEVELS[settings.log_level], settings.log_format)
    names = [name for name, is_here in (("poll", poll), ("work", work), ("notify", notify)) if is_here]
    tracing.begin(settings.traces.endpoint, settings.traces.share, ", ".join(names) or "api")
    is_ready = _upgraded(settings.database_url, stop)
    with _opened(settings) as opened:
        if not is_ready:
            yield opened
            return
        _warn_of_plain_secrets(opened)
        parts = [
            *([Thread(target=_guarded, args=(_poll, opened, settings, stop), name="poller")] if poll else []),
            *([Thread(target=_guarded, args=(_work, opened, settings, stop), name="worker")] if work else []),
            *([Thread(target=_guarded, args=(_notify, opened, settings, stop), name="notifier")] if notify else []),
        ]
        for part in parts:
            part.start()
        try:
            yield opened
        finally:
            stop.set()
            for part in parts:
                part.join()


def _upgraded(url: str, stop: Signal) -> bool:
    """Bring the database up to date, waiting for a server that does not answer; False if `stop` is set first.

    Raises:
        OperationalError: a file, or a server that answers but cannot be used, so that waiting would not help.
    """
    is_waiting = False
    while not stop.is_set():
        try:
            migrate.upgrade(url)
        except OperationalError as error:
            if make_url(url).get_backend_name() == "sqlite" or not is_away(error):
                raise
            if not is_waiting:
                log.warning("waiting for the database, which cannot be reached: %s", str(error.orig).splitlines()[0])
            is_waiting = True
            stop.wait(LOOK_UP)
        else:
            if is_waiting:
                log.warning("the database can be reached again")
            return True
    return False


def _warn_of_plain_secrets(opened: sessionmaker[Session]) -> None:
    """Log how many recipients' secrets are stored unencrypted.

    Raises:
        SecretKeyError: the key in the environment is malformed, or is not the database's.
    """
    with opened() as session:
        plain = select(func.count(Receiver.id)).where(
            Receiver.kind != "email",
            Receiver.removed_at.is_(None),
            not_(type_coerce(Receiver.address, Text).startswith(encryption.PREFIX)),
        )
        if count := session.scalar(plain):
            log.warning(
                "addresses and secrets of %d recipients are stored unencrypted; set %s (docs/reference/settings.md)",
                count,
                encryption.VARIABLE,
            )
        session.scalars(select(Receiver.secret).limit(1)).one_or_none()
    encryption.is_key_set()


def executors(settings: Settings) -> "Executors":
    """The executors that the settings select.

    Raises:
        RuntimeError: Dask is not installed.
    """
    if settings.jobs.executor == "dask":
        from service.jobs.cluster import dask_cluster

        return dask_cluster(settings.jobs, settings.effects_folder)
    from service.jobs.executors import local_processes

    return local_processes(settings.jobs.processes, settings.effects_folder)


def work_until_idle(opened: sessionmaker[Session], settings: Settings) -> int:
    """Do jobs until none waits; the number of jobs done."""
    from service.jobs.executors import end
    from service.jobs.kept import kept_by_user
    from service.jobs.worker import Worker
    from service.kinds import KINDS

    started = executors(settings)
    with process_folder() as notes:
        try:
            return Worker(
                opened, started, settings, KINDS, notes=notes, kept=kept_by_user(settings.jobs.kept_room)
            ).run_until_idle()
        finally:
            end(started)


Part = Callable[[sessionmaker[Session], Settings, Signal], None]


def _guarded(part: Part, opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    """Run a part; its crash ends the others too, so that the supervisor sees it and restarts the service."""
    try:
        part(opened, settings, stop)
    except Exception:
        log.exception("%s crashed", part.__name__.strip("_"))
    finally:
        stop.set()


def _poll(opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    from service.poller import Poller

    Poller(opened, settings).run(stop)


def _work(opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    from service.analyses.loading import load
    from service.jobs.executors import end, in_processes, is_warmed

    started = executors(settings)
    if is_warmed(settings):  # while this process imports the following
        in_processes(started, load, settings.jobs.processes)
    from service.jobs.kept import kept_by_user
    from service.jobs.worker import Worker
    from service.kinds import KINDS
    from service.models.warming import warm

    with process_folder() as notes:
        try:
            kept = kept_by_user(settings.jobs.kept_room)
            Worker(opened, started, settings, KINDS, notes=notes, kept=kept, warming=warm).run(stop)
        finally:
            end(started)


def _notify(opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    from service.notify.notifier import Notifier

    Notifier(opened, settings).run(stop)


@contextmanager
def process_folder() -> Iterator[Path]:
    """A temporary folder of this process that does not outlive it; folders of killed processes are removed first.

    The process locks its folder, and the system releases the lock when the process dies. The next process that needs a
    folder removes those without a lock.
    """
    sweep()
    with TemporaryDirectory(prefix=WORK_FOLDER) as name, Path(name, "new.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        Path(lock.name).rename(Path(name, LOCK))  # renamed when locked, so that no process sees it unlocked
        yield Path(name)


def sweep() -> None:
    """Remove the folders of processes that have ended."""
    for folder in Path(gettempdir()).glob(f"{WORK_FOLDER}*"):
        try:
            is_left = _is_left(folder)
        except OSError:  # just removed, or another user's
            continue
        if is_left:
            rmtree(folder, ignore_errors=True)


def _is_left(folder: Path) -> bool:
    """True if the folder is this user's and no process holds its lock."""
    status = folder.lstat()
    if status.st_uid != os.geteuid() or folder.is_symlink():
        return False
    try:
        with (folder / LOCK).open() as lock:
            flock(lock, LOCK_EX | LOCK_NB)
    except FileNotFoundError:
        return time() - status.st_mtime > YOUNG
    except BlockingIOError:
        return False
    return True
