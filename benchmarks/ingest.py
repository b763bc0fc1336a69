"""Storing and reading back the waveforms of one event: our blobs against a row per sample, and against Steim2 by ObsPy.

    python benchmarks/ingest.py

19 channels of 18,000 counts: the paper's building under AKT013, every level in x and y and the isolators' displacement,
with the noise and the digitizer of `menshin demo`. Each way keeps the same numbers in a file of its own, and gives them
back exactly. Best of five, one process; times include the commit, and are never compared between runs.
"""

import sqlite3
import tempfile
from collections.abc import Callable, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import perf_counter

import numpy as np
from obspy import Stream, Trace, read
from sqlalchemy import select
from sqlalchemy.orm import undefer

from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from service.buildings.tables import Building
from service.db import blobs, migrate, sessions
from service.demo.earthquakes import prepared, recorded
from service.records.tables import Event, Waveform

RATE, ROUNDS = 100.0, 5
NOISE, RESOLUTION = 1e-4, 4 * 9.80665 / 2**24  # m/s², m/s² per count
NOW = datetime(2026, 1, 1, tzinfo=UTC)
Counts = Mapping[str, "np.ndarray[tuple[int], np.dtype[np.int32]]"]


def event() -> Counts:
    """(18000,) counts by channel code."""
    motion = recorded()[0]
    shaking = prepared(motion, RATE, 30.0, 180.0 - 30.0 - motion.acceleration.shape[1] / motion.rate)
    shaking *= 0.7013 / np.abs(shaking).max()
    rng = np.random.default_rng(1)
    series: dict[str, np.ndarray] = {}
    for axis, ground in zip("XY", shaking, strict=True):
        response = simulate(BUILDING, ISOLATOR, ground, RATE)
        levels = np.vstack([ground, response.base_acceleration, response.floor_acceleration])
        series |= {f"{number:02d}.HN{axis}": level for number, level in enumerate(levels)}
    series["01.HYX"] = simulate(BUILDING, ISOLATOR, shaking[0], RATE).isolator_displacement
    return {
        code: np.round((values + NOISE * rng.standard_normal(values.size)) / RESOLUTION).astype(np.int32)
        for code, values in series.items()
    }


class Blobs:
    """service.db.blobs in the service's own SQLite database."""

    name = "our blobs in SQLite"

    def __init__(self, folder: Path) -> None:
        self.path = folder / "blobs.sqlite"
        url = f"sqlite:///{self.path}"
        migrate.upgrade(url)
        self.sessions = sessions.sessions(url)
        with self.sessions.begin() as session:
            session.add(Building(code="B", name="B", created_at=NOW))
        self.events = 0

    def write(self, counts: Counts) -> None:
        end = NOW + timedelta(seconds=180)
        with self.sessions.begin() as session:
            held = Event(building_id=1, start=NOW, end=end, state="queued", created_at=NOW, updated_at=NOW)
            held.waveforms = [
                Waveform(channel=code, start=NOW, rate=RATE, count=c.size, gain=RESOLUTION, samples=blobs.encode(c))
                for code, c in counts.items()
            ]
            session.add(held)
        self.events += 1

    def read(self) -> Counts:
        wanted = select(Waveform).where(Waveform.event_id == self.events).options(undefer(Waveform.samples))
        with sessions.reading(self.sessions)() as session:
            return {row.channel: blobs.decode(row.samples) for row in session.scalars(wanted)}

    def size(self) -> float:
        """Bytes of an event's samples as stored."""
        with self.sessions() as session:
            return sum(len(samples) for samples in session.scalars(select(Waveform.samples))) / self.events


class Rows:
    """A row per sample in SQLite, by the standard library alone."""

    name = "a row per sample in SQLite"

    def __init__(self, folder: Path) -> None:
        self.path = folder / "rows.sqlite"
        self.connection = sqlite3.connect(self.path)
        self.connection.execute("PRAGMA journal_mode=WAL")
        self.connection.execute("PRAGMA synchronous=NORMAL")
        self.connection.execute(
            "CREATE TABLE sample (event INTEGER, channel INTEGER, n INTEGER, value INTEGER, "
            "PRIMARY KEY (event, channel, n)) WITHOUT ROWID"
        )
        self.events, self.codes = 0, []

    def write(self, counts: Counts) -> None:
        self.events += 1
        self.codes = list(counts)
        with self.connection:
            for channel, values in enumerate(counts.values()):
                rows = ((self.events, channel, n, value) for n, value in enumerate(values.tolist()))
                self.connection.executemany("INSERT INTO sample VALUES (?, ?, ?, ?)", rows)

    def read(self) -> Counts:
        query = "SELECT value FROM sample WHERE event = ? AND channel = ? ORDER BY n"
        return {
            code: np.fromiter((v for (v,) in self.connection.execute(query, (self.events, channel))), np.int32)
            for channel, code in enumerate(self.codes)
        }

    def size(self) -> float:
        """Bytes of the file for each event."""
        self.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return self.path.stat().st_size / self.events


class Steim2:
    """A miniSEED file, Steim2, by ObsPy."""

    name = "Steim2 file by ObsPy"

    def __init__(self, folder: Path) -> None:
        self.path = folder / "event.mseed"

    def write(self, counts: Counts) -> None:
        traces = [
            Trace(c, {"location": code[:2], "channel": code[3:], "sampling_rate": RATE}) for code, c in counts.items()
        ]
        Stream(traces).write(str(self.path), format="MSEED", encoding="STEIM2")

    def read(self) -> Counts:
        return {f"{t.stats.location}.{t.stats.channel}": t.data for t in read(str(self.path), format="MSEED")}

    def size(self) -> float:
        """Bytes of the file."""
        return float(self.path.stat().st_size)


def best(action: Callable[[], object]) -> float:
    """s, of the quickest round."""
    times = []
    for _ in range(ROUNDS):
        begin = perf_counter()
        action()
        times.append(perf_counter() - begin)
    return min(times)


def main() -> None:
    counts = event()
    samples = sum(c.size for c in counts.values())
    print(f"{len(counts)} channels, {samples} samples")
    print(f"{'':28} {'B/sample':>8} {'write ms':>9} {'read ms':>8}   ours is faster: write, read")
    reference: tuple[float, float] | None = None
    with tempfile.TemporaryDirectory() as folder:
        for way in (Blobs(Path(folder)), Steim2(Path(folder)), Rows(Path(folder))):
            written = best(lambda way=way: way.write(counts))
            taken = best(way.read)
            back = way.read()
            assert all(np.array_equal(back[code], c) for code, c in counts.items()), way.name
            reference = reference or (written, taken)
            ratios = f"{written / reference[0]:.1f} x, {taken / reference[1]:.1f} x"
            print(f"{way.name:28} {way.size() / samples:8.2f} {1e3 * written:9.2f} {1e3 * taken:8.2f}   {ratios}")


if __name__ == "__main__":
    main()
