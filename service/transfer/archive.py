"""The file of an export: a ZIP file with a manifest, tables as lines of JSON, and original files by their SHA-256.

A file from outside is read with limits, and nothing of it is ever written to a path that it names.
"""

import re
import zlib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Literal, Self
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

import orjson
from pydantic import BaseModel, ConfigDict, Field, ValidationError

FORMAT = "menshin-building"
VERSION = 1
"""Version of this layout; that of the tables is the revision of the database."""
MANIFEST = "manifest.json"
NAME = re.compile(r"tables/([a-z_]{1,60})\.jsonl|files/([0-9a-f]{64})", re.ASCII)
LONGEST = 256 * 2**20
"""Bytes of a row, of a file and of the manifest at most. Not tuned."""
SMALL, RATIO = 64 * 2**20, 100
"""Bytes that any export may unpack to, and how many times its size a larger one may: records compress to a third."""
NAMED = 3
"""Unexpected names that a message lists."""


class ArchiveError(Exception):
    """A file that is no export, is damaged, or contradicts itself; the message says what was found."""


class TableEntry(BaseModel):
    """A table in the manifest."""

    model_config = ConfigDict(extra="forbid", strict=True)

    rows: int = Field(ge=0, description="Number of rows.")
    sha256: str = Field(description="SHA-256 of the entry.")
    first: int | None = Field(ge=0, description="Smallest number of a row; null without rows, or where rows have none.")
    last: int | None = Field(ge=0, description="Largest number of a row.")


class Manifest(BaseModel):
    """The manifest of an export."""

    model_config = ConfigDict(extra="forbid", strict=True)

    format: Literal["menshin-building"]
    version: Literal[1]
    menshin: str = Field(description="Version of Menshin that wrote it.")
    revision: str = Field(description="Revision of the database that it comes from: the columns of the tables.")
    exported_at: str = Field(description="UTC.")
    building: str = Field(description="Code of the building.")
    name: str = Field(description="Name of the building.")
    with_secrets: bool = Field(description="True if passwords and other secrets are in it.")
    files: int = Field(ge=0, description="Number of original files.")
    tables: dict[str, TableEntry]


class Writer:
    """An export that is being written."""

    def __init__(self, file: IO[bytes]) -> None:
        self.zip = ZipFile(file, "w", ZIP_DEFLATED)
        self.tables: dict[str, TableEntry] = {}
        self.files = 0

    def rows(self, table: str, rows: Iterator[dict[str, Any]]) -> None:
        """Write a table; rows come in the order of their numbers."""
        digest, count = sha256(), 0
        first: int | None = None
        last: int | None = None
        with self.zip.open(f"tables/{table}.jsonl", "w", force_zip64=True) as entry:
            for row in rows:
                line = orjson.dumps(row, option=orjson.OPT_APPEND_NEWLINE)
                entry.write(line)
                digest.update(line)
                count += 1
                if "id" in row:
                    first, last = row["id"] if first is None else first, row["id"]
        self.tables[table] = TableEntry(rows=count, sha256=digest.hexdigest(), first=first, last=last)

    def file(self, digest: str, data: bytes) -> None:
        """Write an original file."""
        self.zip.writestr(f"files/{digest}", data)
        self.files += 1

    def finish(self, **described: Any) -> Manifest:  # noqa: ANN401  fields of the manifest
        """Write the manifest and the end of the file."""
        manifest = Manifest.model_validate(
            {"format": FORMAT, "version": VERSION, "files": self.files, "tables": self.tables, **described}
        )
        self.zip.writestr(MANIFEST, manifest.model_dump_json(indent=2))
        self.zip.close()
        return manifest


@dataclass(frozen=True, slots=True)
class Archive:
    """An export that is read; `opened` has checked its names, its sizes and its manifest."""

    zip: ZipFile
    manifest: Manifest
    digests: tuple[str, ...]
    """SHA-256 of the original files."""

    def rows(self, table: str) -> Iterator[dict[str, Any]]:
        """The rows of a table.

        Raises:
            ArchiveError: they are damaged, or others than the manifest says.
        """
        name, expected = f"tables/{table}.jsonl", self.manifest.tables[table]
        digest, count = sha256(), 0
        with _said(name), self.zip.open(name) as entry:
            while line := entry.readline(LONGEST + 1):
                if len(line) > LONGEST:
                    raise ArchiveError(f"{name} has a row of more than {LONGEST // 2**20} MiB")
                digest.update(line)
                count += 1
                yield _row(line, f"{name}, row {count}")
        if (count, digest.hexdigest()) != (expected.rows, expected.sha256):
            raise ArchiveError(f"{name} is not the one that the manifest describes: it was changed")

    def file(self, digest: str) -> bytes:
        """An original file.

        Raises:
            ArchiveError: it is damaged.
        """
        name = f"files/{digest}"
        if self.zip.getinfo(name).file_size > LONGEST:
            raise ArchiveError(f"{name} has more than {LONGEST // 2**20} MiB")
        with _said(name):
            data = self.zip.read(name)
        if sha256(data).hexdigest() != digest:
            raise ArchiveError(f"the content of {name} does not match its name: it was changed")
        return data

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.zip.close()


def opened(path: Path, revision: str, tables: Mapping[str, object], earlier: Collection[str] = frozenset()) -> Archive:
    """An export, as far as it can be judged before its rows are read.

    Args:
        path: of the file.
        revision: of this installation's database.
        tables: names of the tables that an export of this version has.
        earlier: other revisions that it may come from; such an export has the tables of its own revision.

    Raises:
        ArchiveError: it is no export, or none that this version can take in.
    """
    try:
        found = ZipFile(path)
    except (BadZipFile, NotImplementedError, ValueError, EOFError) as error:
        raise ArchiveError(f"it is not an export of a building, or its end is missing ({error})") from None
    try:
        digests = _checked(found, path.stat().st_size)
        manifest = _manifest(found, revision, earlier)
        _compare(found, manifest, tables if manifest.revision == revision else manifest.tables, digests)
    except BaseException:
        found.close()
        raise
    return Archive(found, manifest, digests)


def _checked(found: ZipFile, size: int) -> tuple[str, ...]:
    """Digests of the files in an archive that has expected names and sizes alone."""
    names = [one.filename for one in found.infolist()]
    strange = [name for name in names if name != MANIFEST and not NAME.fullmatch(name)]
    if strange or len(set(names)) < len(names):
        listed = ", ".join(map(repr, strange[:NAMED])) or "a name twice"
        raise ArchiveError(f"it is not an export of a building: it has {listed}")
    if MANIFEST not in names:
        raise ArchiveError(f"it is not an export of a building: it has no {MANIFEST}")
    unpacked = sum(one.file_size for one in found.infolist())
    if unpacked > max(SMALL, RATIO * size):
        raise ArchiveError(f"it would unpack to {unpacked / 1e6:.0f} MB, more than {RATIO} times its size")
    for one in found.infolist():
        if one.flag_bits & 1 or one.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
            raise ArchiveError(f"{one.filename} is encrypted, or compressed by another method than an export uses")
    return tuple(match[2] for name in names if (match := NAME.fullmatch(name)) and match[2])


def _manifest(found: ZipFile, revision: str, earlier: Collection[str]) -> Manifest:
    if found.getinfo(MANIFEST).file_size > 2**20:
        raise ArchiveError(f"{MANIFEST} has more than 1 MiB")
    with _said(MANIFEST):
        document = _row(found.read(MANIFEST), MANIFEST)
    if document.get("format") != FORMAT:
        raise ArchiveError(f"{MANIFEST} has the format {str(document.get('format'))[:50]!r} instead of {FORMAT!r}")
    if document.get("version") != VERSION:
        raise ArchiveError(
            f"it has version {str(document.get('version'))[:50]} of the format, and this Menshin reads {VERSION}; "
            "use the version of Menshin that wrote it"
        )
    try:
        manifest = Manifest.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        raise ArchiveError(f"{MANIFEST}: {'.'.join(map(str, first['loc']))[:200]}: {first['msg']}") from None
    if manifest.revision not in {revision, *earlier}:
        raise ArchiveError(
            f"it comes from a database of revision {manifest.revision[:50]!r} (Menshin {manifest.menshin[:50]}), which "
            f"this version does not know; its own is {revision!r}. Upgrade this installation to the other's version"
        )
    return manifest


def _compare(found: ZipFile, manifest: Manifest, tables: Mapping[str, object], digests: tuple[str, ...]) -> None:
    """Refuse entries that the manifest does not describe, and the other way round."""
    there = {match[1] for name in found.namelist() if (match := NAME.fullmatch(name)) and match[1]}
    for name in sorted({*there, *manifest.tables} ^ {*tables} | there ^ {*manifest.tables}):
        raise ArchiveError(f"table {name} is missing, or is not a table of an export")
    if len(digests) != manifest.files:
        raise ArchiveError(f"it has {len(digests)} original files, and its manifest says {manifest.files}")


def _row(line: bytes, where: str) -> dict[str, Any]:
    try:
        row = orjson.loads(line)
    except orjson.JSONDecodeError as error:
        raise ArchiveError(f"{where} is not JSON: {error}") from None
    if not isinstance(row, dict):
        raise ArchiveError(f"{where} is not a JSON object")
    return row


@contextmanager
def _said(name: str) -> Iterator[None]:
    """Errors of unpacking in words."""
    try:
        yield
    except (BadZipFile, zlib.error, EOFError, NotImplementedError, OSError) as error:
        raise ArchiveError(f"{name} is damaged: {error}") from None
