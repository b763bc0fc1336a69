"""Backup of an SQLite database while processes use it, and its restoration.

A server has programs of its own for that, which docs/operate/running.md names.
"""

import os
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from shutil import copyfile
from urllib.parse import quote

from sqlalchemy import URL, make_url

from service.db.migrate import known_revisions
from service.db.problems import shown

AT_ONCE = 1024
"""Pages that are copied between two reports of the progress."""
PATIENCE = 1.0
"""s that a database may be locked before it counts as in use."""
JOURNALS = ("-wal", "-shm")
"""Endings of the files beside a database in use."""
ReportStep = Callable[[str, int, int], None]


class BackupError(Exception):
    """A database that cannot be backed up or restored; the message says why and what to do."""


def backup(url: str, file: Path, report_step: ReportStep) -> int:
    """Copy the database as it is at this moment to a new file, and check the copy.

    Processes go on writing meanwhile; what they write is not in the copy.

    Args:
        url: of the database.
        file: that does not exist.
        report_step: called with the progress.

    Returns:
        Its size, bytes.

    Raises:
        BackupError: the database is a server's or is not there, the file exists, or the copy is damaged.
    """
    source = _file(make_url(url))
    if not source.is_file():
        raise BackupError(f"{shown(make_url(url))} does not exist; correct database_url")
    if file.exists():
        raise BackupError(f"{file} exists already; name another file, or move it away")
    with _beside(file) as unfinished:
        _copy(source, unfinished, report_step)
        unfinished.rename(file)
    return file.stat().st_size


def restore(url: str, file: Path, now: datetime) -> Path | None:
    """Put a backup in the place of the database, which no process may use.

    Args:
        url: of the database.
        file: a backup; it stays as it is.
        now: aware time.

    Returns:
        Where the database is that was there before; None if there was none.

    Raises:
        BackupError: the database is a server's or in use, or the file is no whole database of this version or earlier.
    """
    target = _file(make_url(url))
    target.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    with _beside(target) as unfinished:
        _copy(file, unfinished, lambda doing, done, of: None)
        if not target.exists():
            unfinished.rename(target)
            return None
        _refuse_used(target)
        before = target.with_name(f"{target.name}.before-{now.astimezone(UTC):%Y%m%dT%H%M%SZ}")
        for ending in ("", *JOURNALS):
            if (old := Path(f"{target}{ending}")).exists():
                _keep(old, Path(f"{before}{ending}"))
        for ending in JOURNALS:  # of a damaged database; they do not belong to the new one
            Path(f"{target}{ending}").unlink(missing_ok=True)
        unfinished.chmod(target.stat().st_mode & 0o770)
        unfinished.replace(target)
    return before


def files_outside(file: Path) -> tuple[int, int]:
    """Number and bytes of the original files of a backup that are in the store of `storage.originals`."""
    with closing(sqlite3.connect(f"file:{quote(str(file.resolve()))}?mode=ro", uri=True)) as opened:
        columns = {name for _, name, *_ in opened.execute("PRAGMA table_info(content)")}
        if "is_outside" not in columns:  # of an earlier version
            return 0, 0
        counted = "SELECT count(*), coalesce(sum(size), 0) FROM content WHERE is_outside AND deleted_at IS NULL"
        files, size = opened.execute(counted).fetchone()
    return files, size


def _keep(old: Path, kept: Path) -> None:
    """A second name for a file, whose first one will be another's; a copy where the file system has no such thing."""
    try:
        os.link(old, kept)
    except OSError:
        copyfile(old, kept)
        kept.chmod(old.stat().st_mode & 0o770)


def _file(address: URL) -> Path:
    """The file of a database."""
    if address.get_backend_name() != "sqlite":
        plain = address.database or "menshin"
        raise BackupError(
            f"{shown(address)} is backed up by PostgreSQL's own programs: pg_dump --format=custom --file=menshin.dump "
            f"{plain}, and, with the service stopped, pg_restore --dbname={plain} --clean --if-exists menshin.dump"
        )
    if not address.database or address.database == ":memory:" or address.database.startswith("file:"):
        raise BackupError(f"{shown(address)} is not named by its file; name it as in sqlite:////srv/menshin.sqlite")
    return Path(address.database)


@contextmanager
def _beside(file: Path) -> Iterator[Path]:
    """An empty file in the folder of another, readable by its owner alone; removed if it is still there at the end."""
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    os.close(handle)
    try:
        yield Path(name)
    finally:
        for ending in ("", "-journal", *JOURNALS):
            Path(f"{name}{ending}").unlink(missing_ok=True)


def _copy(source: Path, copy: Path, report_step: ReportStep) -> None:
    """Copy a database at one moment, and check the copy."""
    address = f"file:{quote(str(source.resolve()))}?mode=rw"
    try:
        with (
            closing(sqlite3.connect(address, uri=True, isolation_level=None)) as opened,
            closing(sqlite3.connect(copy, isolation_level=None)) as target,
        ):
            opened.execute("BEGIN")  # without it, each commit of another process would begin the copy anew
            opened.execute("SELECT count(*) FROM sqlite_master").fetchone()
            opened.backup(
                target,
                pages=AT_ONCE,
                progress=lambda _, left, of: report_step("pages", of - left, of),
            )
            target.execute("PRAGMA journal_mode=DELETE")
            _check(source, target)
    except sqlite3.Error as error:
        raise BackupError(f"{source} cannot be read as a database: {error}") from None
    with copy.open("rb+") as written:
        os.fsync(written.fileno())


def _check(source: Path, copy: sqlite3.Connection) -> None:
    """Refuse a copy that is damaged, or not Menshin's."""
    problems = [str(row[0]) for row in copy.execute("PRAGMA integrity_check(1)")]
    if problems != ["ok"]:
        raise BackupError(f"{source} is damaged: {problems[0]}")
    tables = {name for (name,) in copy.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if "alembic_version" not in tables:
        raise BackupError(f"{source} is not a database of Menshin")
    found = {revision for (revision,) in copy.execute("SELECT version_num FROM alembic_version")}
    if unknown := found - known_revisions():
        raise BackupError(f"{source} belongs to another version of Menshin (revision {', '.join(sorted(unknown))})")


def _refuse_used(database: Path) -> None:
    """Refuse a database that a process has open: only the last one may leave the write-ahead log."""
    try:
        with closing(sqlite3.connect(database, timeout=PATIENCE, isolation_level=None)) as opened:
            opened.execute("PRAGMA journal_mode=DELETE")
    except sqlite3.OperationalError as error:
        raise BackupError(f"{database} is in use ({error}); stop all processes of the service") from None
    except sqlite3.DatabaseError:
        return  # damaged: what is restored takes its place
