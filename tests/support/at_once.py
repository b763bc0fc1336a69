"""Two transactions of PostgreSQL at once, in an order that is the same every time."""

import re
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event as Signal, get_ident
from time import monotonic, sleep

from sqlalchemy import event, text
from sqlalchemy.orm import Session, sessionmaker

LIMIT = 30.0
"""s, far longer than any of these transactions takes."""
WAITING = text(
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock' AND pid <> "
    "pg_backend_pid()"
)


def interleave(
    sessions: sessionmaker[Session], first: Callable[[], object], after: str, second: Callable[[], object]
) -> None:
    """Do `first` until it has executed a statement, `second` until it waits for a lock or has ended, then the rest.

    Args:
        sessions: of both.
        first: begins.
        after: pattern of the statement.
        second: comes in between.
    """
    engine, done, go_on, running = sessions.kw["bind"], Signal(), Signal(), list[int]()

    def begin() -> None:
        running.append(get_ident())
        first()

    def pause(_1: object, _2: object, statement: str, *_3: object) -> None:
        if running == [get_ident()] and not done.is_set() and re.search(after, statement, re.DOTALL):
            done.set()
            go_on.wait(LIMIT)

    event.listen(engine, "after_cursor_execute", pause)
    try:
        with ThreadPoolExecutor(2) as pool:
            both = [pool.submit(begin)]
            both[0].add_done_callback(lambda _: done.set())
            try:
                assert done.wait(LIMIT), f"the first does not reach a statement like {after!r}"
                if not both[0].done():
                    both.append(pool.submit(second))
                    _wait(sessions, both[1])
            finally:
                go_on.set()
            for one in both:
                one.result(LIMIT)
            assert len(both) == 2, f"no statement of the first is like {after!r}"
    finally:
        event.remove(engine, "after_cursor_execute", pause)


def _wait(sessions: sessionmaker[Session], second: Future[object]) -> None:
    """Until it waits for a lock or has ended."""
    end = monotonic() + LIMIT
    while not second.done():
        with sessions.kw["bind"].connect() as connection:  # a transaction would see the same activity each time
            if connection.scalar(WAITING):
                return
        assert monotonic() < end, "the second neither ends nor waits for a lock"
        sleep(0.01)
