"""Bytes that the database keeps of one analysed earthquake, by kind, and of a building's year of them.

The record is one of `menshin demo`: ten channels at 100 samples a second, two directions, from a real motion. The
service itself reads, analyses and compares it.
"""

import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from sqlite3 import connect

from benchmarks import city
from service.db import migrate, sessions as database

A_YEAR = 60
"""Analysed earthquakes of a building in a year, as in the other benchmarks."""
BLOBS = {
    "original files": ("content", ("data",)),
    "waveforms": ("waveform", ("samples",)),
    "histories of force and motion": (
        "direction_result",
        ("force", "force_rigid", "force_modal", "displacement", "velocity"),
    ),
    "their standard deviations": (
        "direction_result",
        ("force_std_history", "displacement_std_history", "velocity_std_history"),
    ),
    "torsion and axial load": ("layer_result", ("torsion", "torsion_std_history", "axial_load")),
}


def sizes(file: Path) -> Iterator[tuple[str, int]]:
    """Bytes of the blobs, by kind; then of all pages but theirs."""
    with closing(connect(file)) as opened:
        total = 0
        for kind, (table, columns) in BLOBS.items():
            length = " + ".join(f"coalesce(length({column}), 0)" for column in columns)
            size = int(opened.execute(f"SELECT coalesce(sum({length}), 0) FROM {table}").fetchone()[0])
            total += size
            yield kind, size
        [(samples, duration)] = opened.execute("SELECT sum(count), max(count / rate) FROM waveform").fetchall()
        print(f"{samples} samples of all channels, {duration:.0f} s")
    yield "rows, indexes and pages that are not full", pages(file) - total


def pages(file: Path) -> int:
    """Bytes of a database without free pages."""
    with closing(connect(file)) as opened:
        opened.execute("VACUUM")
        opened.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return file.stat().st_size


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "one.sqlite"
        migrate.upgrade(f"sqlite:///{file}")
        empty = pages(file)
        made = database.sessions(f"sqlite:///{file}")
        city.analysed(made, city.NOWHERE, datetime.now(UTC).replace(microsecond=0))
        made.kw["bind"].dispose()
        found = dict(sizes(file))
    *_, rows = found
    found[rows] -= empty
    found["all"] = sum(found.values())
    for kind, size in found.items():
        print(f"{kind:45} {size / 1e3:8.0f} kB an earthquake {A_YEAR * size / 1e6:8.0f} MB a year of {A_YEAR}")


if __name__ == "__main__":
    sys.exit(main())
