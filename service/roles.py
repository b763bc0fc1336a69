"""The service's parts as they run together in one process tree, and how they end."""

import logging
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event as Signal, Thread
from types import FrameType

from sqlalchemy import Text, func, make_url, not_, select, type_coerce
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import logs
from service.db import encryption, migrate
from service.db.problems import is_away
from service.db.sessions import sessions
from service.notify.tables import Receiver
from service.own_folders import own_folder
from service.settings import Settings

log = logging.getLogger(__name__)

LOOK_UP = 0.5
"""s."""


@contextmanager
def migrated(settings: Settings) -> Iterator[sessionmaker[Session]]:
    """Sessions at a database that is brought up to date first."""
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
def signalled() -> Iterator[Signal]:
    """Set when the process is asked to end (Ctrl-C, SIGTERM)."""
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
    """Wait until we are asked to end.

    In short waits: a handler runs only once the main thread does, and a signal that comes just before a wait without
    end begins was seen to be slept through.
    """
    while not stop.wait(LOOK_UP):
        pass


@contextmanager
def running(
    settings: Settings, stop: Signal, *, poll: bool = False, work: bool = False, notify: bool = False
) -> Iterator[sessionmaker[Session]]:
    """The poller, the worker and the notifier beside what the caller does, with sessions; all have ended afterwards.

    None of them starts if `stop` is set while the database is away.
    """
    logs.begin(logs.LEVELS[settings.log_level])
    is_there = _upgraded(settings.database_url, stop)
    with _opened(settings) as opened:
        if not is_there:
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
    """Bring the database up to date, and wait for a server that is away; False if `stop` is set before it comes.

    Raises:
        OperationalError: it is a file, or a server that answers but cannot be used: waiting would not help.
    """
    is_waiting = False
    while not stop.is_set():
        try:
            migrate.upgrade(url)
        except OperationalError as error:
            if make_url(url).get_backend_name() == "sqlite" or not is_away(error):
                raise
            if not is_waiting:
                log.warning("waiting for the database, which is out of reach: %s", str(error.orig).splitlines()[0])
            is_waiting = True
            stop.wait(LOOK_UP)
        else:
            if is_waiting:
                log.warning("the database is there")
            return True
    return False


def _warn_of_plain_secrets(opened: sessionmaker[Session]) -> None:
    """Log how many receivers' secrets are stored without encryption.

    Raises:
        SecretKeyError: the key in the environment is malformed, or another one than that of the database.
    """
    with opened() as session:
        plain = select(func.count(Receiver.id)).where(
            Receiver.kind != "email",
            Receiver.removed_at.is_(None),
            not_(type_coerce(Receiver.address, Text).startswith(encryption.PREFIX)),
        )
        if count := session.scalar(plain):
            log.warning(
                "%d receivers' addresses and secrets are stored unencrypted; set %s (docs/reference/settings.md)",
                count,
                encryption.VARIABLE,
            )
        session.scalars(select(Receiver.secret).limit(1)).one_or_none()
    encryption.is_key_set()


def worked_off(opened: sessionmaker[Session], settings: Settings) -> int:
    """Work until no job waits; the number of jobs that were done."""
    from service.jobs.executors import end, executors
    from service.jobs.worker import Worker
    from service.kinds import KINDS

    made = executors(settings)
    with own_folder() as notes:
        try:
            return Worker(opened, made, settings, KINDS, notes=notes).run_until_idle()
        finally:
            end(made, settings)


Part = Callable[[sessionmaker[Session], Settings, Signal], None]


def _guarded(part: Part, opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    """A part that crashes ends the others too: whoever started us sees it and starts us again."""
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
    from service.jobs.executors import end, executors
    from service.jobs.worker import Worker
    from service.kinds import KINDS

    made = executors(settings)
    with own_folder() as notes:
        try:
            Worker(opened, made, settings, KINDS, notes=notes).run(stop)
        finally:
            end(made, settings)


def _notify(opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    from service.notify.notifier import Notifier

    Notifier(opened, settings).run(stop)
