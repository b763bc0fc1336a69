"""A folder that files arrive in."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from errno import EINVAL
from pathlib import Path
from stat import S_ISREG
from typing import NamedTuple

from service.records.sources.source import (
    Arrival,
    Cursor,
    Known,
    Memory,
    SourceError,
    Step,
    TooLargeError,
    in_batches,
)

SAFELY = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
"""A link or a pipe that takes the file's place at the last moment is neither followed nor waited for."""
DOCUMENTS = {".toml", ".md", ".pdf", ".rst"}
"""Suffixes of files that lie beside records and are no records."""
RIGHTS = "give the service's account the right to read it"
DOCUMENT_NAMES = {"license", "readme", "copying"}


class Mark(NamedTuple):
    """Version of a file."""

    size: int
    """Bytes."""
    changed: float
    """s since 1970, of the last change."""


@dataclass(frozen=True, slots=True)
class Folder:
    """Every file in a folder and below, except hidden files and documents."""

    path: Path
    max_bytes: int
    settle_time: float
    """s for which a file must have stayed unchanged."""
    memory: Memory

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """New and changed files; one that still grows is left for the next poll.

        Raises:
            SourceError: the folder is not there; after all others, the first file or folder that cannot be read.
        """
        self._check()
        unreadable: list[OSError] = []
        seen: dict[str, str] = cursor.get("seen", {})
        growing: dict[str, str] = {}
        for file, mark in self._new_files(unreadable):
            address = str(file)
            age = now.timestamp() - mark.changed  # negative where the clock was set back since: then it is seen twice
            is_young = age < self.settle_time if age >= 0 else address not in seen
            if seen.get(address, str(mark)) != str(mark) or is_young:
                growing[address] = str(mark)
                continue
            try:
                arrival = self._arrival(file)
            except OSError as error:
                unreadable.append(error)
                continue
            if _mark(file) != mark:  # it grew while it was read
                growing[address] = str(mark)
                continue
            yield Step((arrival,), cursor, (Known(address, str(mark)),))
        if growing != seen:
            yield Step((), {"seen": growing})
        if unreadable:
            raise SourceError(_unreadable(unreadable))

    def _check(self) -> None:
        try:
            is_there = self.path.is_dir()
        except OSError as error:
            raise SourceError(f"{self.path} cannot be read: {error.strerror}; {RIGHTS}") from error
        if not is_there:
            state = "is not a folder" if self.path.exists() else "does not exist"
            raise SourceError(f"the folder {self.path} {state}; create it, or correct location in the building file")

    def _new_files(self, unreadable: list[OSError]) -> Iterator[tuple[Path, Mark]]:
        """New and changed files with their marks; files that cannot be read are noted."""
        for batch in in_batches(self._files(unreadable)):
            known = self.memory.known([str(file) for file in batch])
            for file in batch:
                try:
                    mark, had = _mark(file), known.get(str(file))
                except OSError as error:
                    unreadable.append(error)
                    continue
                if mark is not None and (had is None or had.mark != str(mark)):
                    yield file, mark

    def _files(self, unreadable: list[OSError]) -> list[Path]:
        files = []
        for folder, folders, names in os.walk(self.path, onerror=unreadable.append):
            folders[:] = (name for name in folders if not name.startswith("."))
            files += [Path(folder, name) for name in names if not name.startswith(".")]
        return sorted(path for path in files if not _is_document(path))

    def _arrival(self, file: Path) -> Arrival:
        name, origin = str(file.relative_to(self.path)), str(file)
        if (target := file.resolve()) != file and not target.is_relative_to(self.path.resolve()):
            refusal = (
                f"{file} is a symbolic link to outside the folder, which is not followed; put a copy there instead"
            )
            return Arrival(name=name, origin=origin, data=None, refusal=refusal)
        with os.fdopen(os.open(target, SAFELY), "rb") as opened:
            status = os.fstat(opened.fileno())
            if not S_ISREG(status.st_mode):
                raise OSError(EINVAL, "not a regular file any more", origin)
            if status.st_size <= self.max_bytes:
                data = opened.read(self.max_bytes + 1)
                if len(data) <= self.max_bytes:
                    return Arrival(name=name, origin=origin, data=data)
        refusal = str(TooLargeError(origin, status.st_size, self.max_bytes))
        return Arrival(name=name, origin=origin, data=None, refusal=refusal)


def _unreadable(errors: Sequence[OSError]) -> str:
    problem = f"{errors[0].filename} cannot be read: {errors[0].strerror}"
    return f"{problem} (and {len(errors) - 1} more); {RIGHTS}" if errors[1:] else f"{problem}; {RIGHTS}"


def _mark(file: Path) -> Mark | None:
    """None if the file was removed, or is not a regular file."""
    try:
        status = file.stat()
    except FileNotFoundError:
        return None
    return Mark(status.st_size, status.st_mtime) if S_ISREG(status.st_mode) else None


def _is_document(file: Path) -> bool:
    return file.suffix.lower() in DOCUMENTS or file.stem.lower() in DOCUMENT_NAMES
