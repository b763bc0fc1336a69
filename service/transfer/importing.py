"""Import of an exported building: all of it in one transaction, or nothing.

Numbers of rows stay where none of them is in use here, so that links in earlier messages still lead to their pages;
otherwise those of a table are shifted together, in every place that refers to them.
"""

import base64
import binascii
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from sqlalchemy import JSON, BigInteger, Boolean, Column, Float, Integer, LargeBinary, Table, func, insert, select, text
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import DataError, IntegrityError
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db.base import Base, UtcDateTime
from service.db.sessions import NulError
from service.jobs.stages import ReportStep
from service.records import originals
from service.records.file_store import store_of
from service.records.originals import Secured
from service.settings.groups import Storage
from service.transfer.archive import Archive, ArchiveError
from service.transfer.contents import DELETED, FILES, Shifts, shifted, tables

AT_ONCE = 100
"""Rows that are written at once."""
LARGEST, LARGEST_BIG = 2**31 - 1, 2**63 - 1
"""Largest integers of the databases."""


@dataclass(frozen=True, slots=True)
class _Known:
    """Rows of the export that others may refer to, by table."""

    shifts: Shifts
    of: dict[str, set[Any]] = field(default_factory=dict)


def import_building(
    sessions: sessionmaker[Session], archive: Archive, report_step: ReportStep, settings: Storage
) -> None:
    """Take in an exported building.

    Args:
        sessions: of this installation.
        archive: the file.
        report_step: called with the progress.
        settings: of original files, which go into a store before anything is imported.

    Raises:
        StoreAwayError: as of `originals.secured`; nothing was imported.
        BuildingError: a building of its code is here already.
        ArchiveError: the file is damaged or contradicts itself; nothing was imported.
    """
    _refuse_known(sessions, archive)
    is_server = sessions.kw["bind"].dialect.name == "postgresql"
    if settings.originals is not None:
        for digest in archive.digests:
            originals.secured(archive.file(digest), settings)
    reserved = {one.name: _reserved(sessions, one, archive) for one in _numbered()} if is_server else None
    with sessions.begin() as session:
        shifts = reserved or {one.name: _shift(session, one, archive) for one in _numbered()}
        try:
            _insert(session, archive, shifts, report_step, settings)
            session.flush()
            _check(session, archive)
        except (IntegrityError, DataError) as error:
            reason = str(error.orig).splitlines()[0][:200]
            raise ArchiveError(f"it contradicts itself or this database: {reason}") from None
        except NulError as error:
            raise ArchiveError(str(error)) from None


def _refuse_known(sessions: sessionmaker[Session], archive: Archive) -> None:
    code = archive.manifest.building
    with sessions() as session:
        if session.scalar(select(Building.id).where(Building.code == code)) is not None:
            raise building_store.BuildingError(
                f"building {code!r} already exists here, and an import does not merge buildings; nothing was imported"
            )


def _numbered() -> list[Table]:
    """Tables whose rows have a number."""
    return [one for one in tables() if "id" in one.c]


def _shift(session: Session, table: Table, archive: Archive) -> int:
    """Offset to add to the numbers of a table; 0 where none of them is in use."""
    entry = archive.manifest.tables[table.name]
    if entry.first is None or entry.last is None:
        return 0
    in_use = select(func.max(table.c.id), func.count().filter(table.c.id.between(entry.first, entry.last)))
    largest, shared = session.execute(in_use).one()
    shift = max(0, largest - entry.first + 1) if shared else 0
    if entry.last + shift > LARGEST:
        raise ArchiveError(f"table {table.name} has numbers up to {entry.last}, for which no room is left here")
    return int(shift)


def _reserved(sessions: sessionmaker[Session], table: Table, archive: Archive) -> int:
    """The same, with the numbers set aside from the server's sequence, which other processes go on taking from."""
    with sessions.begin() as session:
        session.execute(text(f'LOCK TABLE "{table.name}" IN SHARE ROW EXCLUSIVE MODE'))
        sequence = session.scalar(select(func.pg_get_serial_sequence(table.name, "id")))
        taken = session.execute(text(f"SELECT last_value FROM {sequence} WHERE is_called")).scalar() or 0
        entry = archive.manifest.tables[table.name]
        shift = _shift(session, table, archive)
        if shift:  # numbers that were given out and never stored, or deleted, are not used again
            shift = max(shift, taken + 1 - (entry.first or 0))
        last = max(taken, (entry.last or 0) + shift)
        if last > LARGEST:
            raise ArchiveError(f"table {table.name} has numbers up to {entry.last}, for which no room is left here")
        if last:
            session.execute(select(func.setval(sequence, last)))
        return shift


def _insert(session: Session, archive: Archive, shifts: Shifts, report_step: ReportStep, settings: Storage) -> None:
    """Insert all rows, each after those that it refers to."""
    known = _Known(shifts)
    total = sum(one.rows for one in archive.manifest.tables.values()) + archive.manifest.files
    done = 0
    for digest in archive.digests:
        originals.add(session, Secured(digest, archive.file(digest), store_of(settings)))
        done += 1
        report_step(FILES, done, total)
    known.of[FILES] = {*archive.digests, *_insert_deleted(session, archive)}
    for table in tables():
        known.of[table.name] = set()
        for rows in batches(_row(table, one, known) for one in archive.rows(table.name)):
            session.execute(insert(table), rows)
            done += len(rows)
            report_step(table.name, done, total)
    if len(known.of["building"]) != 1:
        raise ArchiveError(f"it has {len(known.of['building'])} buildings instead of one")


def _insert_deleted(session: Session, archive: Archive) -> Iterator[str]:
    """Insert the rows of original files that were deleted where the export comes from; yields their digests."""
    files = Base.metadata.tables[FILES]
    dialect: Any = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    for given in archive.rows(FILES):
        if given.keys() != set(DELETED) or given["deleted_at"] is None or given["sha256"] in archive.digests:
            raise ArchiveError(f"table {FILES} has a row that is not a deleted file")
        row = {name: _value(files.c[name], given[name]) for name in DELETED}
        session.execute(dialect.insert(files).values({"data": b"", **row}).on_conflict_do_nothing())
        yield row["sha256"]


def _check(session: Session, archive: Archive) -> None:
    """Refuse a building that the manifest does not name, or that cannot be read."""
    manifest = archive.manifest
    row = session.scalars(select(Building).where(Building.code == manifest.building)).one_or_none()
    if row is None:
        raise ArchiveError(f"its building is not {manifest.building!r}, as its manifest says")
    if not session.scalar(select(func.count()).where(Base.metadata.tables["revision"].c.building_id == row.id)):
        raise ArchiveError(f"building {row.code!r} has no description")
    described = building_store.described(session, row).description.code
    if described != row.code:
        raise ArchiveError(f"building {row.code!r} is described as {described!r}")


def batches(rows: Iterator[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    """The rows, as many at a time as are written at once."""
    batch: list[dict[str, Any]] = []
    for row in rows:
        batch.append(row)
        if len(batch) == AT_ONCE:
            yield batch
            batch = []
    if batch:
        yield batch


def _row(table: Table, given: Mapping[str, Any], known: _Known) -> dict[str, Any]:
    """A row for this database, with its own numbers.

    Raises:
        ArchiveError: it is not a row of the table, or refers to one that the export does not have.
    """
    row = values(table, given)
    for column in table.columns:
        for key in column.foreign_keys:
            if (number := row[column.name]) is None:
                continue
            of = key.column.table.name
            if number not in known.of[of]:
                raise ArchiveError(f"a row of {table.name} refers to {of} {number}, which is not in the file before it")
            if key.column.name == "id":
                row[column.name] = number + known.shifts[of]
    if "id" in row:
        known.of[table.name].add(row["id"])
        row["id"] += known.shifts[table.name]
    try:
        return shifted(table.name, row, known.shifts)
    except (KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ArchiveError(f"a row of {table.name} is malformed ({type(error).__name__})") from None


def values(table: Table, given: Mapping[str, Any], names: Collection[str] | None = None) -> dict[str, Any]:
    """The values of a row by column.

    Args:
        table: of the row.
        given: as the export has it.
        names: columns that it must have; None: all of the table.

    Raises:
        ArchiveError: it is not a row of the table.
    """
    expected = table.c.keys() if names is None else names
    if wrong := sorted(given.keys() ^ set(expected)):
        raise ArchiveError(f"table {table.name} has a row with missing or additional columns: {', '.join(wrong)[:200]}")
    return {name: _value(table.c[name], given[name]) for name in expected}


def _value(column: Column[Any], value: Any) -> Any:  # noqa: ANN401  whatever JSON may hold
    """A value of a column.

    Raises:
        ArchiveError: it is of another type.
    """
    where = f"{column.table.name}.{column.name}"
    if value is None:
        if not column.nullable:
            raise ArchiveError(f"{where} is missing in a row")
        return None
    kind = column.type
    if isinstance(kind, UtcDateTime):
        return _time(where, value)
    if isinstance(kind, LargeBinary):
        return _binary(where, value)
    if isinstance(kind, JSON):
        expected: tuple[type, ...] = (dict, list)
    elif isinstance(kind, Boolean):
        expected = (bool,)
    elif isinstance(kind, Integer):
        expected = (int,)
    else:
        expected = (float, int) if isinstance(kind, Float) else (str,)
    is_right = isinstance(value, expected) and (isinstance(value, bool) == (expected == (bool,)))
    if is_right and isinstance(kind, Integer):
        is_right = abs(value) <= (LARGEST_BIG if isinstance(kind, BigInteger) else LARGEST)
    if not is_right:
        raise ArchiveError(f"{where} has {str(value)[:50]!r}, which is not a value of that column")
    return value


def _time(where: str, value: object) -> datetime:
    try:
        found = datetime.fromisoformat(value) if isinstance(value, str) else None
    except ValueError:
        found = None
    if found is None or found.tzinfo is None:
        raise ArchiveError(f"{where} has {str(value)[:50]!r}, which is not a time with its zone")
    return found


def _binary(where: str, value: object) -> bytes:
    try:
        if not isinstance(value, str):
            raise ValueError("no text")
        return base64.b64decode(value, validate=True)
    except (ValueError, binascii.Error):
        raise ArchiveError(f"{where} has a value that is not base64") from None
