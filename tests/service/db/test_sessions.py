"""The database is reached by many at once, from its first moment on."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

from service.db.sessions import engine

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
