"""The application behind its real server on loopback."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread
from time import sleep

from api_client import VISITOR

from service.access.roles import Caller
from service.app import create
from service.http.connections import TimeLimits
from service.http.server import server
from service.settings import Settings

OWN, LOCALHOST = "http://127.0.0.1:{}", "http://localhost:{}"
"""Public addresses of a service, with its port: two sites for a browser."""


@contextmanager
def api_server(
    url: str, visitor: Caller | None = VISITOR, time_limits: TimeLimits | None = None, **settings: object
) -> Iterator[str]:
    """Address of a service at this database; its public one may be the same (OWN), or by name (LOCALHOST)."""
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = door.getsockname()[1]
        given = {name: value.format(port) if value in (OWN, LOCALHOST) else value for name, value in settings.items()}
        app = create(Settings(database_url=url, **given), visitor)
        running = server(app, time_limits)
        thread = Thread(target=running.run, args=([door],))
        thread.start()
        while not running.started:
            assert thread.is_alive(), "the server did not start"
            sleep(0.01)
        try:
            yield OWN.format(port)
        finally:
            running.should_exit = True
            thread.join()
