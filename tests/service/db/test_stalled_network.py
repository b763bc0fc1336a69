"""A network to the database that loses everything without a word is noticed, and not waited for without end."""

import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from time import monotonic

import pytest
from namespaces import WHY, namespace
from sqlalchemy import make_url

from service.db.sessions import STALLED

pytestmark = pytest.mark.slow

CLIENT = """
import sys, time
from sqlalchemy import text
from sqlalchemy.exc import OperationalError
from service.db.sessions import engine
connection = engine(sys.argv[1]).connect()
connection.execute(text("SELECT 1"))
print("connected", flush=True)
sys.stdin.readline()
try:
    connection.execute(text("SELECT 2"))
except OperationalError as error:
    print(error.orig, flush=True)
"""


def passed_on(source: socket.socket, target: socket.socket) -> None:
    with suppress(OSError):
        while data := source.recv(65536):
            target.sendall(data)


@contextmanager
def relay(address: str, server: Path) -> Iterator[int]:
    """Port of this address that leads to the socket file of a server."""
    with socket.create_server((address, 0)) as listening, socket.socket(socket.AF_UNIX) as there:

        def serve() -> None:
            here, _ = listening.accept()
            there.connect(str(server))
            with here:
                Thread(target=passed_on, args=(there, here), daemon=True).start()
                passed_on(here, there)

        Thread(target=serve, daemon=True).start()
        yield listening.getsockname()[1]


def test_a_statement_does_not_wait_for_a_network_that_is_gone(postgres: str) -> None:
    url = make_url(postgres)
    folder = url.query["host"]
    assert isinstance(folder, str)
    with namespace() as other:
        if other is None:
            pytest.skip(WHY)
        with relay(other.address, Path(folder, ".s.PGSQL.5432")) as port:
            there = url.set(drivername="postgresql+psycopg", host=other.address, port=port, query={})
            given = [*other.inside, sys.executable, "-c", CLIENT, there.render_as_string(hide_password=False)]
            with subprocess.Popen(given, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
                assert client.stdin is not None
                assert client.stdout is not None
                assert client.stdout.readline() == "connected\n"
                other.cut()
                begun = monotonic()
                try:
                    said = client.communicate("go on\n", timeout=3 * STALLED)[0]
                finally:
                    client.kill()
                assert "timed out" in said.lower() or "closed the connection" in said, said
                assert monotonic() - begun > 0.5 * STALLED
