"""An export of an earlier version, as this version would have written it.

Its rows go into an SQLite file that has the tables of their revision. The migrations that upgrade the database of an
installation upgrade this one, and what is in it then is exported again.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from sqlalchemy import JSON, DateTime, MetaData, Table, create_engine, event, func, insert, select
from sqlalchemy.exc import DataError, IntegrityError

from service.buildings.store import BuildingError
from service.db import migrate
from service.db.base import UtcDateTime
from service.db.sessions import reading, sessions
from service.settings.groups import Storage
from service.transfer import archive, contents
from service.transfer.archive import Archive, ArchiveError
from service.transfer.contents import DELETED, FILES
from service.transfer.exporting import export
from service.transfer.importing import batches, values

VERSIONS = "alembic_version"
"""The table of a database's revision."""


@contextmanager
def opened(path: Path) -> Iterator[Archive]:
    """An export with the tables of this version, whichever version wrote it.

    Args:
        path: of the file.

    Raises:
        ArchiveError: it is no export, comes from a later version, or contradicts itself.
    """
    tables = {one.name: one for one in contents.expected()}
    with archive.opened(path, migrate.newest(), tables, migrate.known_revisions()) as found:
        if found.manifest.revision == migrate.newest():
            yield found
            return
        with TemporaryDirectory(prefix="menshin-import-") as folder:  # readable by its owner alone
            written = _upgraded(found, Path(folder))
            with archive.opened(written, migrate.newest(), tables) as made:
                kept = {name: getattr(found.manifest, name) for name in ("menshin", "exported_at", "with_secrets")}
                yield replace(made, manifest=made.manifest.model_copy(update=kept))


def _upgraded(found: Archive, folder: Path) -> Path:
    """The same export with the tables of this version, as a file in the folder."""
    url, file = f"sqlite:///{folder / 'building.sqlite'}", folder / "building.zip"
    migrate.upgrade(url, found.manifest.revision)
    try:
        _fill(url, found)
        migrate.upgrade(url)
        _export(url, found.manifest.building, file)
    except (IntegrityError, DataError) as error:
        raise ArchiveError(f"it contradicts itself: {str(error.orig).splitlines()[0][:200]}") from None
    except BuildingError:
        raise ArchiveError(f"its building is not {found.manifest.building!r}, as its manifest says") from None
    return file


def _fill(url: str, found: Archive) -> None:
    """Write the rows and the original files into the tables of their revision. References are checked by the import."""
    made, known = create_engine(url), MetaData()
    event.listen(known, "column_reflect", _with_own_types)
    try:
        known.reflect(made)
        content = known.tables[FILES]
        tables = {name: one for name, one in known.tables.items() if name not in {*contents.LEFT_OUT, FILES, VERSIONS}}
        for name in sorted({*tables} ^ ({*found.manifest.tables} - {FILES})):
            raise ArchiveError(f"table {name} is missing, or is not a table of an export")
        with made.begin() as connection:
            for digest in found.digests:
                data = found.file(digest)
                connection.execute(insert(content), {"sha256": digest, "size": len(data), "data": data})
            if FILES in found.manifest.tables:
                deleted = (values(content, given, DELETED) | {"data": b""} for given in found.rows(FILES))
                for rows in batches(deleted):
                    connection.execute(insert(content), rows)
            for table in tables.values():
                for rows in batches(values(table, given) for given in found.rows(table.name)):
                    connection.execute(insert(table), rows)
    finally:
        made.dispose()


def _with_own_types(_: object, table: Table, column: dict[str, Any]) -> None:
    """Times and JSON of a table that is read from a database, as the service stores them."""
    if isinstance(column["type"], DateTime):
        column["type"] = UtcDateTime()
    elif isinstance(column["type"], JSON):
        column["type"] = JSON(none_as_null=True)


def _export(url: str, code: str, file: Path) -> None:
    """Export the building, which must be the owner of every row."""
    made = sessions(url)
    try:
        with file.open("wb") as output, reading(made)() as session:
            manifest = export(
                session, code, output, datetime.now(UTC), lambda *_: None, with_secrets=True, settings=Storage()
            )
            for table in contents.tables():
                rows = session.scalar(select(func.count()).select_from(table))
                if rows != manifest.tables[table.name].rows:
                    raise ArchiveError(f"table {table.name} has rows that do not belong to building {code!r}")
    finally:
        made.kw["bind"].dispose()
