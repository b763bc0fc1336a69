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


@contextmanager
def api_server(
    url: str, visitor: Caller | None = VISITOR, time_limits: TimeLimits | None = None, **settings: object
) -> Iterator[str]:
    """Address of a service at this database."""
    app = create(Settings(database_url=url, **settings), visitor)
    with socket.create_server(("127.0.0.1", 0)) as door:
        running = server(app, time_limits)
        thread = Thread(target=running.run, args=([door],))
        thread.start()
        while not running.started:
            assert thread.is_alive(), "the server did not start"
            sleep(0.01)
        try:
            yield f"http://127.0.0.1:{door.getsockname()[1]}"
        finally:
            running.should_exit = True
            thread.join()
