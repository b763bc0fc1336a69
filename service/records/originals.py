"""Original files by their SHA-256: in the database, or in the store that the settings name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from typing import Any

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session, sessionmaker

from service.db.sessions import reading
from service.errors import StoreAwayError
from service.jobs.stages import ReportStep
from service.records.file_store import FileStore, LostFileError, store_of
from service.records.tables import Content
from service.settings.groups import Storage

CONTENT = Content.__table__.c


class DeletedFileError(LostFileError):
    """An original file was deleted, as a setting allows; the message says when and by which one."""


@dataclass(frozen=True, slots=True)
class Secured:
    """Bytes that a row may name: they are in the store, where there is one, before the transaction of the row begins.

    What writes the row takes nothing else, so that no row can name bytes that are not there.
    """

    sha256: str
    data: bytes
    store: FileStore | None
    """None: they go into the database with the row."""

    @property
    def columns(self) -> Mapping[str, Any]:
        """Where the bytes are, as columns of their row."""
        return {"data": self.data if self.store is None else b"", "is_outside": self.store is not None}


def secured(data: bytes, settings: Storage) -> Secured:
    """The bytes, in the store if there is one; call it outside of transactions, which would block other writers.

    Raises:
        StoreAwayError: the store cannot take them.
    """
    digest, store = sha256(data).hexdigest(), store_of(settings)
    if store is not None:
        store.put(digest, data)
    return Secured(digest, data, store)


def add(session: Session, one: Secured) -> None:
    """Write the row of bytes; where it is there already, it stays, and bytes that were deleted are there again."""
    connection = session.connection()
    dialect: Any = postgresql if connection.dialect.name == "postgresql" else sqlite
    row = {"sha256": one.sha256, "size": len(one.data), **one.columns}
    added = dialect.insert(Content).values(row).on_conflict_do_nothing().returning(Content.sha256)
    if connection.execute(added).first() is not None:
        return
    of_it = CONTENT.sha256 == one.sha256
    if connection.scalar(select(CONTENT.deleted_at).where(of_it).with_for_update()) is None:
        return
    if one.store is not None:
        one.store.put(one.sha256, one.data)  # once more: it may just have been deleted
    connection.execute(update(Content).where(of_it).values(deleted_at=None, deleted_by=None, **one.columns))


def read(session: Session, digest: str, settings: Storage) -> bytes:
    """The bytes with a digest, compared with it.

    Raises:
        DeletedFileError: they were deleted.
        LostFileError: they are missing or damaged.
        StoreAwayError: the store cannot be used.
    """
    wanted = (Content.data, Content.is_outside, Content.deleted_at, Content.deleted_by)
    row = session.execute(select(*wanted).where(Content.sha256 == digest)).one_or_none()
    if row is None:
        raise LostFileError(f"the original file {digest} is not known here")
    if row.deleted_at is not None:
        raise DeletedFileError(f"the original file {digest} was {deletion(row.deleted_at, row.deleted_by)}")
    if not row.is_outside:
        if sha256(row.data).hexdigest() != digest:
            raise LostFileError(f"the original file {digest} in the database is damaged; restore it from a backup")
        return bytes(row.data)
    if (store := store_of(settings)) is None:
        raise LostFileError(
            f"the original file {digest} is outside the database, but storage.originals is not set; set it"
        )
    return store.get(digest)


def deletion(at: datetime, rule: str | None) -> str:
    """When and by which rule something was deleted."""
    return f"deleted on {at:%Y-%m-%d} by {rule}"


def deletions(session: Session, digests: Sequence[str]) -> Mapping[str, tuple[datetime, str | None]]:
    """When and by which setting original files were deleted, by their SHA-256; without those that are there."""
    columns = (Content.sha256, Content.deleted_at, Content.deleted_by)
    rows = session.execute(select(*columns).where(Content.sha256.in_(digests), ~is_there()))
    return {digest: (at, rule) for digest, at, rule in rows if at is not None}


def is_there() -> ColumnElement[bool]:
    """True for bytes that were not deleted."""
    return Content.deleted_at.is_(None)


def delete_outside(sessions: sessionmaker[Session], settings: Storage) -> None:
    """Delete in the store what the database says is deleted, one by one: the row is locked for as long as that takes.

    Raises:
        StoreAwayError: the store cannot be used; the next call deletes the rest.
    """
    gone = select(Content.sha256).where(Content.is_outside, Content.deleted_at.is_not(None))
    with reading(sessions)() as session:
        digests = list(session.scalars(gone))
    if not digests:
        return
    if (store := store_of(settings)) is None:
        raise StoreAwayError("deleted original files are still outside the database; set storage.originals")
    store.probe()  # before a row is locked
    for digest in digests:
        with sessions.begin() as session:
            if session.scalar(gone.where(Content.sha256 == digest).with_for_update()) is not None:
                store.delete(digest)
                session.execute(update(Content).where(Content.sha256 == digest).values(is_outside=False))


@dataclass(frozen=True, slots=True)
class Outside:
    """Original files in the store."""

    files: int
    size: int
    """Bytes."""


def outside(session: Session) -> Outside:
    """Files in the store by the rows of the database."""
    counted = select(func.count(), func.coalesce(func.sum(Content.size), 0))
    return Outside(*session.execute(counted.where(Content.is_outside, is_there())).one())


def move(sessions: sessionmaker[Session], settings: Storage, report_step: ReportStep, *, to_store: bool) -> Outside:
    """Move original files one by one between the database and the store; a move that is ended goes on where it was.

    Those that move out are in the store before their row says so. Those that move in stay in the store as well, where
    a process may just be reading them.

    Returns:
        Number and size of the moved ones.

    Raises:
        StoreAwayError: the store cannot be used; what was moved so far stays moved.
        LostFileError: one is missing or damaged.
    """
    done = size = 0
    digests = _digests(sessions, is_outside=not to_store)
    for digest in digests:
        with reading(sessions)() as session:
            data = read(session, digest, settings)
        one = secured(data, settings) if to_store else Secured(digest, data, None)
        here = (Content.sha256 == digest, Content.is_outside != to_store, is_there())
        with sessions.begin() as session:
            session.execute(update(Content).where(*here).values(**one.columns))
        done, size = done + 1, size + len(data)
        report_step("original files", done, len(digests))
    return Outside(done, size)


def check(sessions: sessionmaker[Session], settings: Storage, report_step: ReportStep) -> list[str]:
    """Read every original file in the store; a line for each that is missing or damaged.

    Raises:
        StoreAwayError: the store cannot be used.
    """
    lost: list[str] = []
    digests = _digests(sessions, is_outside=True)
    for done, digest in enumerate(digests, start=1):
        with reading(sessions)() as session:
            try:
                read(session, digest, settings)
            except LostFileError as error:
                lost.append(str(error))
        report_step("original files", done, len(digests))
    return lost


def unknown(sessions: sessionmaker[Session], settings: Storage) -> list[str]:
    """Digests of files in the store that no row names: an import that failed, or a process that was ended before it
    wrote the row, left them, unless one is about to write it.

    Raises:
        StoreAwayError: the store cannot be used.
    """
    store = store_of(settings)
    there = set() if store is None else store.digests()  # before the rows: a file comes first
    if not there:
        return []
    with reading(sessions)() as session:
        return sorted(there.difference(session.scalars(select(Content.sha256))))


def _digests(sessions: sessionmaker[Session], *, is_outside: bool) -> list[str]:
    with reading(sessions)() as session:
        where = select(Content.sha256).where(Content.is_outside == is_outside, is_there()).order_by(Content.sha256)
        return list(session.scalars(where))
