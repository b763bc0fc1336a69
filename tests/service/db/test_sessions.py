"""The database is reached by many at once, from its first moment on."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

from sqlalchemy import text
from sqlalchemy.orm import sessionmaker

from service.db.room import INCREMENTAL
from service.db.sessions import engine, reading

FULL = 2
"""SQLite's number of `synchronous = FULL`."""
TOGETHER = 6
FILES = 100
"""Before SQLite was waited for, one new file in twenty was locked for one of six."""


def test_a_new_sqlite_file_is_opened_by_many_at_once(tmp_path: Path) -> None:
    ready = Barrier(TOGETHER)

    def opened(number: int) -> None:
        made = engine(f"sqlite:///{tmp_path / str(number)}.sqlite")
        ready.wait(10)
        made.connect().close()
        made.dispose()

    with ThreadPoolExecutor(TOGETHER) as pool:
        for number in range(FILES):
            for done in [pool.submit(opened, number) for _ in range(TOGETHER)]:
                done.result()


def test_sqlite_writes_to_the_disk_at_every_commit(tmp_path: Path) -> None:
    made = engine(f"sqlite:///{tmp_path / 'menshin.sqlite'}")
    with made.connect() as connection:
        assert connection.scalar(text("PRAGMA synchronous")) == FULL, "a commit outlives a loss of power"
    made.dispose()


def test_a_new_connection_reads_at_once_while_another_one_writes(tmp_path: Path) -> None:
    address = f"sqlite:///{tmp_path / 'menshin.sqlite'}?timeout=0"
    first, second = engine(address), engine(address)
    with first.begin() as writing:
        writing.execute(text("CREATE TABLE films (id INTEGER)"))
    with first.begin() as writing:
        writing.execute(text("INSERT INTO films VALUES (1)"))
        with reading(sessionmaker(second))() as session:
            assert session.scalar(text("SELECT count(*) FROM films")) == 0
            assert session.scalar(text("PRAGMA auto_vacuum")) == INCREMENTAL, "a new file gives pages back"
    first.dispose()
    second.dispose()
