"""The service's parts as they run together in one process tree, and how they end."""

import logging
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event as Signal
from threading import Thread
from types import FrameType

from sqlalchemy import Text, func, not_, select, type_coerce
from sqlalchemy.orm import Session, sessionmaker

from service import migrate
from service.database import Receiver, encryption
from service.sessions import sessions
from service.settings import Settings

log = logging.getLogger(__name__)

LOOK_UP = 0.5
"""s."""


@contextmanager
def migrated(settings: Settings) -> Iterator[sessionmaker[Session]]:
    """Sessions at a database that is up to date."""
    migrate.upgrade(settings.database_url)
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
) -> Iterator[None]:
    """The poller, the worker and the notifier beside what the caller does; all have ended afterwards."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    logging.getLogger("apscheduler").setLevel(logging.ERROR)  # a look longer than the interval skips one: no fault
    logging.getLogger("httpx").setLevel(logging.WARNING)
    with migrated(settings) as opened:
        _warn_of_plain_secrets(opened)
        parts = [
            *([Thread(target=_guarded, args=(_poll, opened, settings, stop), name="poller")] if poll else []),
            *([Thread(target=_guarded, args=(_work, opened, settings, stop), name="worker")] if work else []),
            *([Thread(target=_guarded, args=(_notify, opened, settings, stop), name="notifier")] if notify else []),
        ]
        for part in parts:
            part.start()
        try:
            yield
        finally:
            stop.set()
            for part in parts:
                part.join()


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
                "%d receivers' addresses and secrets are stored unencrypted; set %s (docs/settings.md)",
                count,
                encryption.VARIABLE,
            )
        session.scalars(select(Receiver.secret).limit(1)).one_or_none()
    encryption.is_key_set()


def api(settings: Settings, stop: Signal) -> None:
    """Serve the API until it is asked to end."""
    import uvicorn

    from service.app import create

    server = uvicorn.Server(
        uvicorn.Config(
            create(settings), settings.host, settings.port, log_level="warning", proxy_headers=False
        )  # who asks is told by the connection, not by what a header says of it
    )

    def end_with_the_others() -> None:
        stop.wait()
        server.should_exit = True

    Thread(target=end_with_the_others, daemon=True, name="end of the API").start()
    log.info("serving at http://%s:%d", settings.host, settings.port)
    server.run()


def worked_off(opened: sessionmaker[Session], settings: Settings) -> int:
    """Work until no job waits; the number of jobs that were done."""
    from service.computing.executors import end, executors
    from service.computing.worker import Worker

    made = executors(settings)
    with TemporaryDirectory(prefix="menshin-") as notes:
        try:
            return Worker(opened, made, settings, notes=Path(notes)).run_until_idle()
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
    from service.computing.executors import end, executors
    from service.computing.worker import Worker

    made = executors(settings)
    with TemporaryDirectory(prefix="menshin-") as notes:
        try:
            Worker(opened, made, settings, notes=Path(notes)).run(stop)
        finally:
            end(made, settings)


def _notify(opened: sessionmaker[Session], settings: Settings, stop: Signal) -> None:
    from service.notices.notifier import Notifier

    Notifier(opened, settings).run(stop)
