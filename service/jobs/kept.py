"""Results that need not be computed again by another job or command: in memory and on disk.

The folder survives a restart. It is a cache: any of its files may be removed at any time, by another process too. Files
are pickles, as the values that pass between the processes of a worker are, so that only files of this user in a folder
that nobody else may write to are read. Each begins with a digest of its pickle, since a damaged one might be read as
other numbers.
"""

import logging
import os
import pickle
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from hashlib import blake2b, sha256
from importlib.metadata import version
from pathlib import Path
from tempfile import NamedTemporaryFile
from time import time
from typing import Any

from platformdirs import user_cache_path

import core
from service.version import VERSION

log = logging.getLogger(__name__)

IN_MEMORY = 12
"""Results in memory, those used last. An analysis of 180 s in two directions has 8 MB. A choice."""
SUFFIX, UNFINISHED = ".kept", ".new"
DIGEST = 32
"""Bytes of the digest before a pickle."""
LEFT = 3600.0
"""s after which a file that is still unfinished was left by a process that was ended."""
NUMERICS = ("numpy", "scipy", "numba")
"""Packages whose version is part of the code that computes."""


@dataclass(slots=True)
class Kept:
    """Results by the keys of their stages."""

    folder: Path | None = None
    """None: in memory only."""
    size: int = 0
    """Bytes that the folder may take; files that were not used for longest are removed."""
    latest: OrderedDict[str, Any] = field(default_factory=OrderedDict)
    """In memory, the latest used last; at most IN_MEMORY."""
    found: int = 0
    """Results that were found."""

    def find(self, key: str) -> Any | None:  # noqa: ANN401  any stage's result
        """The result, None if it is not kept."""
        found = self.latest[key] if key in self.latest else self._read(key)
        if found is not None:
            self.found += 1
            self._remember(key, found)
        return found

    def add(self, key: str, result: object) -> None:
        """Keep a result."""
        self._remember(key, result)
        if self.folder is None:
            return
        written = pickle.dumps(result, pickle.HIGHEST_PROTOCOL)
        try:
            with NamedTemporaryFile(dir=self.folder, suffix=UNFINISHED, delete=False) as file:
                try:
                    file.write(_digest(written))
                    file.write(written)
                    file.flush()
                    Path(file.name).replace(self._path(self.folder, key))
                except OSError:
                    Path(file.name).unlink(missing_ok=True)
                    raise
            self._make_room(self.folder)
        except OSError as error:
            log.warning("%s keeps no more results: %s", self.folder, error.strerror)
            self.folder = None

    def _remember(self, key: str, result: object) -> None:
        self.latest[key] = result
        self.latest.move_to_end(key)
        if len(self.latest) > IN_MEMORY:
            self.latest.popitem(last=False)

    def _read(self, key: str) -> Any | None:  # noqa: ANN401
        """From the folder; a file that is damaged, or another user's, is removed."""
        if self.folder is None:
            return None
        path = self._path(self.folder, key)
        try:
            found = pickle.loads(_intact(path))
            os.utime(path)  # its last use
        except FileNotFoundError:
            return None
        except Exception as error:  # of a damaged file; where the code has changed unseen, a pickle may raise anything
            log.warning("removed %s, which cannot be used: %s", path, error)
            with suppress(OSError):
                path.unlink()
            return None
        return found

    def _path(self, folder: Path, key: str) -> Path:
        return folder / f"{sha256(f'{key} {_code()}'.encode()).hexdigest()}{SUFFIX}"

    def _make_room(self, folder: Path) -> None:
        """Remove the files that were not used for longest, down to the allowed size, and those left unfinished."""
        total = 0
        for status, path in sorted(_files(folder), key=lambda pair: -pair[0].st_mtime_ns):
            total += status.st_size
            is_left = path.suffix == UNFINISHED and time() - status.st_mtime > LEFT
            if is_left or (total > self.size and path.suffix == SUFFIX):
                path.unlink(missing_ok=True)


def _files(folder: Path) -> Iterator[tuple[os.stat_result, Path]]:
    """Files of the folder; other processes may remove some at any time."""
    for path in (*folder.glob(f"*{SUFFIX}"), *folder.glob(f"*{UNFINISHED}")):
        with suppress(FileNotFoundError):
            yield path.stat(), path


def _intact(path: Path) -> bytes:
    """The pickle in a file.

    Raises:
        FileNotFoundError: there is none.
        OSError: it is a link.
        ValueError: it is another user's, or damaged.
    """
    with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW), "rb") as file:
        if os.fstat(file.fileno()).st_uid != os.geteuid():
            raise ValueError("it is another user's")
        read = file.read()
    if _digest(read[DIGEST:]) != read[:DIGEST]:
        raise ValueError("it is damaged")
    return read[DIGEST:]


def _digest(written: bytes) -> bytes:
    return blake2b(written, digest_size=DIGEST).digest()


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
    """Digest of the code that computes: another version's results are other results."""
    top = Path(core.__path__[0])
    sources = ((str(one.relative_to(top)), one.read_bytes()) for one in sorted(top.rglob("*.py")))
    return sha256(repr((VERSION, *((one, version(one)) for one in NUMERICS), *sources)).encode()).hexdigest()
