"""Results that need not be computed again by another job or command: in memory and on disk.

The folder survives a restart. It is a cache: any of its files may be removed at any time. Files are pickles, as the
values that pass between the processes of a worker are, so that a folder others may write to is not used.
"""

import logging
import os
import pickle
from collections import OrderedDict
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

import core
from service.version import VERSION

log = logging.getLogger(__name__)

IN_MEMORY = 12
"""Results in memory, those used last. An analysis of 180 s in two directions has 8 MB. A choice."""
SUFFIX = ".kept"


@dataclass(slots=True)
class Kept:
    """Results by the keys of their stages."""

    folder: Path | None = None
    """None: in memory only."""
    size: int = 0
    """Bytes that the folder may take; files that were not used for longest are removed."""
    latest: OrderedDict[str, Any] = field(default_factory=OrderedDict)
    """In memory, the latest used last; at most IN_MEMORY."""

    def find(self, key: str) -> Any | None:  # noqa: ANN401  any stage's result
        """The result, None if it is not kept."""
        found = self.latest[key] if key in self.latest else self._read(key)
        if found is not None:
            self._remember(key, found)
        return found

    def add(self, key: str, result: object) -> None:
        """Keep a result."""
        self._remember(key, result)
        if self.folder is None:
            return
        new = self.folder / f"{os.getpid()}.new"
        try:
            with new.open("wb") as file:
                pickle.dump(result, file, pickle.HIGHEST_PROTOCOL)
            new.replace(self._path(self.folder, key))
            self._make_room(self.folder)
        except OSError as error:
            log.warning("%s keeps no more results: %s", self.folder, error.strerror)
            new.unlink(missing_ok=True)
            self.folder = None

    def _remember(self, key: str, result: object) -> None:
        self.latest[key] = result
        self.latest.move_to_end(key)
        if len(self.latest) > IN_MEMORY:
            self.latest.popitem(last=False)

    def _read(self, key: str) -> Any | None:  # noqa: ANN401
        """From the folder; a file that cannot be read is removed."""
        if self.folder is None or not (path := self._path(self.folder, key)).exists():
            return None
        try:
            found = pickle.loads(path.read_bytes())
            os.utime(path)  # its last use
        except Exception:  # a torn file may raise anything
            log.warning("removed %s, which cannot be read", path, exc_info=True)
            with suppress(OSError):
                path.unlink()
            return None
        return found

    def _path(self, folder: Path, key: str) -> Path:
        return folder / f"{sha256(f'{key} {_code()}'.encode()).hexdigest()}{SUFFIX}"

    def _make_room(self, folder: Path) -> None:
        """Remove the files that were not used for longest, down to the allowed size."""
        files = sorted(((one.stat(), one) for one in folder.glob(f"*{SUFFIX}")), key=lambda pair: -pair[0].st_mtime_ns)
        total = 0
        for status, path in files:
            total += status.st_size
            if total > self.size:
                path.unlink(missing_ok=True)


def kept_in(folder: Path, size: int) -> Kept:
    """Results kept in a folder of this user, which is made; in memory only where that cannot be, or for no size."""
    if size <= 0:
        return Kept()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError as error:
        log.info("results are kept in memory only: %s", error)
        return Kept()
    if status.st_uid != os.geteuid() or status.st_mode & 0o022:
        log.warning("results are kept in memory only: others may write to %s; remove it", folder)
        return Kept()
    return Kept(folder, size)


def kept_by_user(room: float) -> Kept:
    """Results kept in the user's cache folder.

    Args:
        room: GB, the setting `jobs.kept_room`.
    """
    return kept_in(user_cache_path("menshin") / "analyses", int(room * 1e9))


@cache
def _code() -> str:
    """Stamp of the code that computes: another version's results are other results."""
    sources = sorted(Path(core.__path__[0]).rglob("*.py"))
    stamps = ((one.name, status.st_mtime_ns, status.st_size) for one in sources for status in (one.stat(),))
    return sha256(repr((VERSION, *stamps)).encode()).hexdigest()
