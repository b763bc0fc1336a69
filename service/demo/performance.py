"""The demonstration itself: a monitoring server, and the service that polls it as in production."""

import logging
import tomllib
from collections.abc import Callable
from contextlib import ExitStack, suppress
from datetime import UTC, datetime
from pathlib import Path
from threading import Event as Signal, Thread

import httpx
from rich.console import Console
from sqlalchemy.orm import Session, sessionmaker

from service import roles, serving
from service.access.roles import Caller, Role
from service.buildings import store as building_store
from service.demo.server import LOOPBACK, application, free_port, listening
from service.demo.site import CODE, building_file
from service.demo.stage import BUILDING, DATABASE, Stage
from service.settings import Settings
from service.settings.groups import Polling

VISITOR = Caller("visitor", Role.engineer)
"""A spectator at this machine, who needs no key because the building is simulated; admin functions need one."""
POLL_INTERVAL = 5.0  # s, so that the spectator need not wait
FIRST_PAGE = 10.0
"""s given to the first page, before the address is printed all the same."""

Tale = Callable[[Stage, sessionmaker[Session], Signal, Console], None]
"""The text for the spectator, in its own thread, until it ends or is stopped."""


def perform(stage: Stage, settings: Settings, tale: Tale, console: Console) -> None:
    """Serve, fetch and analyse until stopped."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    with ExitStack() as stack:
        stop = stack.enter_context(roles.stop_signal())
        server = stack.enter_context(listening(application(stage.archive), free_port(_port_before(stage.folder))))
        console.print(f"monitoring server of the simulated building: {server}/fdsnws/")
        sessions = stack.enter_context(roles.migrated(settings))
        with sessions.begin() as session:
            put_under_watch(session, stage.folder, building_file(server, stage.scenario.sensors))
        stack.enter_context(roles.running(settings, stop, poll=True, work=True, notify=True))
        teller = Thread(target=tale, args=(stage, sessions, stop, console), name="teller")
        teller.start()
        stack.callback(teller.join)
        stack.callback(stop.set)
        door = stack.enter_context(serving.listening(settings))

        def answering() -> None:
            with suppress(httpx.HTTPError):  # the first page takes longest; it is read before the address is printed
                httpx.get(f"{address(settings)}/", timeout=FIRST_PAGE, trust_env=False)
            console.print(f"[bold]Menshin answers at {address(settings)}/[/] (Ctrl-C ends it)")

        serving.api_in_own_process(settings, stop, door, VISITOR, answering)
    console.print("ended; the next start carries on from here")


def settings_of(folder: Path, port: int) -> Settings:
    """The settings with the demonstration's own database and port.

    Messages link to its own pages where no other address is set.
    """
    settings = Settings(
        database_url=f"sqlite:///{folder / DATABASE}", host=LOOPBACK, port=port, polling=Polling(interval=POLL_INTERVAL)
    )
    return settings.model_copy(update={"public_url": settings.public_url or address(settings)})


def address(settings: Settings) -> str:
    """Address of the pages and the API."""
    return f"http://{settings.host}:{settings.port}"


def put_under_watch(session: Session, folder: Path, text: str) -> None:
    """Add the building, or update the address of its monitoring server; its file lies in the folder."""
    now = datetime.now(UTC)
    (folder / BUILDING).write_text(text)
    try:
        building_store.find(session, CODE)
    except building_store.BuildingError:
        building_store.add(session, text, folder, now)
    else:
        building_store.update_description(session, text, folder, now)


def _port_before(folder: Path) -> int:
    """The monitoring server's previous port, 0 if there was none."""
    file = folder / BUILDING
    if not file.exists():
        return 0
    address: str = tomllib.loads(file.read_text())["source"]["location"]
    return int(address.rpartition(":")[2])
