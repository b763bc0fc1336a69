"""Temporary folders that do not outlive their process, however it ends.

A process holds a lock on its folder, which the system releases when the process dies. The next process that needs a
folder removes those without a lock.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from fcntl import LOCK_EX, LOCK_NB, flock
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir
from time import time

PREFIX = "menshin-work-"
LOCK = "owner.lock"
YOUNG = 60.0
"""s in which a new folder may still be without a lock."""


@contextmanager
def process_folder() -> Iterator[Path]:
    """A temporary folder of this process; folders of killed processes are removed first."""
    sweep()
    with TemporaryDirectory(prefix=PREFIX) as name, Path(name, "new.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        Path(lock.name).rename(Path(name, LOCK))  # renamed when locked, so that no process sees it unlocked
        yield Path(name)


def sweep() -> None:
    """Remove the folders of processes that have ended."""
    for folder in Path(gettempdir()).glob(f"{PREFIX}*"):
        try:
            is_left = _is_left(folder)
        except OSError:  # just removed, or another user's
            continue
        if is_left:
            rmtree(folder, ignore_errors=True)


def _is_left(folder: Path) -> bool:
    """True if the folder is this user's and no process holds its lock."""
    status = folder.lstat()
    if status.st_uid != os.geteuid() or folder.is_symlink():
        return False
    try:
        with (folder / LOCK).open() as lock:
            flock(lock, LOCK_EX | LOCK_NB)
    except FileNotFoundError:
        return time() - status.st_mtime > YOUNG
    except BlockingIOError:
        return False
    return True
