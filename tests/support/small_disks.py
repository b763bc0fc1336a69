"""File systems of a few MiB, which are full soon."""

import errno
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Path]:
    """A file system of its own at a new folder; the test is skipped where none can be mounted, which needs root.

    Args:
        folder: where it is mounted.
        size: `32m` for 32 MiB.
    """
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", folder], capture_output=True, text=True
    )
    if mounted.returncode != 0:
        pytest.skip(f"no file system can be mounted here: {mounted.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


def fill(folder: Path, left: int = 0) -> Path:
    """Write a file that leaves so many bytes of the file system, while others write; remove it to have room again."""
    filling = folder / "filling"
    with filling.open("wb") as file:
        while (more := shutil.disk_usage(folder).free - left) > 0:
            try:
                os.posix_fallocate(file.fileno(), file.seek(0, os.SEEK_END), more)
            except OSError as error:
                if error.errno != errno.ENOSPC:  # another writer took a part of it since
                    raise
    return filling
