"""Free pages of an SQLite file, given back to the disk."""

from typing import Any

from sqlalchemy.orm import Session, sessionmaker

AT_ONCE = 1000
"""Pages that are given back in one transaction, for which other writers wait: 4 MB. Not tuned."""
INCREMENTAL = 2
"""SQLite's number of files that give pages back in steps: those that this version makes, or has rewritten."""


def give_back(sessions: sessionmaker[Session], *, whole: bool) -> str:
    """Give free pages back to the disk, and say what was given back or what helps.

    Args:
        sessions: of the database.
        whole: rewrite the file in one step; afterwards it gives pages back in steps.
    """
    with sessions() as session:
        if session.get_bind().dialect.name != "sqlite":
            return "PostgreSQL uses the room for new rows (autovacuum); VACUUM FULL gives it back to the disk"
        before = _free(session)
        is_incremental = session.connection().exec_driver_sql("PRAGMA auto_vacuum").scalar() == INCREMENTAL
    if whole:
        connection = sessions.kw["bind"].raw_connection()
        try:
            rewriting: Any = connection.driver_connection
            rewriting.execute("VACUUM")  # outside of a transaction
        finally:
            connection.close()
    elif is_incremental:
        while True:
            with sessions.begin() as session:
                free = _free(session)
                driver: Any = session.connection().connection.driver_connection
                driver.execute(f"PRAGMA incremental_vacuum({AT_ONCE})").fetchall()  # a page with each step
                if not free or _free(session) >= free:
                    break
    elif before:
        return (
            f"{before / 1e6:.1f} MB of the database's file are free for new records; `menshin prune --compact` gives "
            "them back to the disk, for which it needs as much room as the file has"
        )
    with sessions() as session:
        return f"{(before - _free(session)) / 1e6:.1f} MB are given back to the disk"


def _free(session: Session) -> int:
    """Bytes of the file's free pages."""
    connection = session.connection()
    pages, size = (connection.exec_driver_sql(f"PRAGMA {one}").scalar() for one in ("freelist_count", "page_size"))
    return int(pages or 0) * int(size or 0)
