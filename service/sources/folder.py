"""A folder that files arrive in."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from service.sources.arrival import Arrival, Cursor, SourceError, Step, TooLargeError

DOCUMENTS = {".toml", ".md", ".pdf", ".rst"}
"""What lies beside records and is none."""
DOCUMENT_NAMES = {"license", "readme", "copying"}


@dataclass(frozen=True, slots=True)
class Folder:
    """Every file in a folder and below; hidden files and documents are none of it."""

    path: Path
    max_bytes: int
    settle_time: float
    """s that a file must have been left unchanged."""

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """New and changed files; one that still grows is left for the next look."""
        if not self.path.is_dir():
            raise SourceError(f"{self.path} is no folder; make it, or correct location in the building file")
        taken: dict[str, list[float]] = dict(cursor.get("taken", {}))
        seen: dict[str, list[float]] = dict(cursor.get("seen", {}))
        for file in self._files():
            name, mark = str(file.relative_to(self.path)), _mark(file)
            if mark is None or taken.get(name) == mark:
                continue
            growing = name in seen and seen[name] != mark
            if growing or now.timestamp() - mark[1] < self.settle_time:
                seen[name] = mark
                yield Step((), {"taken": dict(taken), "seen": dict(seen)})
                continue
            arrival = self._arrival(file, name, int(mark[0]))
            if _mark(file) != mark:  # it grew while it was read
                continue
            taken[name] = mark
            seen.pop(name, None)
            yield Step((arrival,), {"taken": dict(taken), "seen": dict(seen)})

    def _files(self) -> list[Path]:
        found = (path for path in self.path.rglob("*") if path.is_file() and not _is_document(path))
        return sorted(path for path in found if not any(p.startswith(".") for p in path.relative_to(self.path).parts))

    def _arrival(self, file: Path, name: str, size: int) -> Arrival:
        if size > self.max_bytes:
            return Arrival(
                name=name, origin=str(file), data=None, refusal=str(TooLargeError(str(file), size, self.max_bytes))
            )
        try:
            return Arrival(name=name, origin=str(file), data=file.read_bytes())
        except OSError as error:
            raise SourceError(f"{file} cannot be read: {error.strerror}; the service needs the right to") from error


def _mark(file: Path) -> list[float] | None:
    """Size in bytes and time of the last change; None if the file is gone."""
    try:
        status = file.stat()
    except FileNotFoundError:
        return None
    return [status.st_size, status.st_mtime]


def _is_document(file: Path) -> bool:
    return file.suffix.lower() in DOCUMENTS or file.stem.lower() in DOCUMENT_NAMES
