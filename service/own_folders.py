"""Temporary folders that do not stay behind, however the process ends that made them.

A process holds a lock on its folder, which the system gives free when it dies. The next process that needs a folder
removes those that none holds any more.
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
"""s in which a folder that has no lock yet may still get it."""


@contextmanager
def own_folder() -> Iterator[Path]:
    """A folder of this process; those of processes that were killed are removed first."""
    sweep()
    with TemporaryDirectory(prefix=PREFIX) as name, Path(name, "new.lock").open("w") as lock:
        flock(lock, LOCK_EX)
        Path(lock.name).rename(Path(name, LOCK))  # complete at once: nobody sees it unlocked
        yield Path(name)


def sweep() -> None:
    """Remove the folders of processes that are gone."""
    for folder in Path(gettempdir()).glob(f"{PREFIX}*"):
        try:
            is_left = _is_left(folder)
        except OSError:  # it has just been removed, or is another user's
            continue
        if is_left:
            rmtree(folder, ignore_errors=True)


def _is_left(folder: Path) -> bool:
    """Whether it is a folder of this user's that no process holds."""
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
