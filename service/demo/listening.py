"""A web application on a socket of its own, for as long as it is wanted."""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

import uvicorn
from starlette.applications import Starlette

LOOPBACK = "127.0.0.1"


@contextmanager
def listening(application: Starlette, port: int = 0) -> Iterator[str]:
    """The address under which the application answers on loopback, from a thread; port 0 takes a free one."""
    with socket.create_server((LOOPBACK, port)) as door:
        server = uvicorn.Server(uvicorn.Config(application, log_level="warning", lifespan="off"))
        thread = Thread(target=server.run, args=([door],), name="monitoring server", daemon=True)
        thread.start()
        while not server.started and thread.is_alive():
            time.sleep(0.01)
        try:
            yield f"http://{LOOPBACK}:{door.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(timeout=10.0)


def free_port(wanted: int) -> int:
    """The wanted port if nobody listens there, else a free one."""
    for port in (wanted, 0):
        try:
            with socket.create_server((LOOPBACK, port)) as door:
                return int(door.getsockname()[1])
        except OSError:
            continue
    raise OSError(f"no port is free at {LOOPBACK}")
