"""From an earthquake in a live stream, played in real time, to its messages: the whole service, nothing left out.

    OMP_NUM_THREADS=1 python benchmarks/streams.py

A SeedLink server, as a process of its own, sends 50 s of noise, the first minute of the paper's building in half of
AKT013, and noise, in records of 512 bytes of five channels at 100 Hz; each is sent when its last sample is over.
`menshin up` follows it with SQLite and one worker. It takes three minutes.

Exit code 0: the goal of docs/operate/streams.md was reached and every packet is kept; 1: a sentence says what was not.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import sleep, time

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # server and records are the tests'

import numpy as np
import paper_records
from monitoring_server import miniseed
from obspy import Stream, Trace, UTCDateTime
from paper_records import GAIN, RATE
from pymseed import MS3Record
from seedlink_server import SeedLinkServer, seedlink_server
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from core.arrays import Vector
from service.analyses.tables import Analysis
from service.db.sessions import sessions
from service.notify.tables import Message
from service.records.tables import Packet, StreamState

BEFORE, SHAKEN, AFTER = 50, 60, 100  # s
LONGEST = 120  # s after the shaking that the benchmark waits
GOAL = 60
"""s after the shaking in which the result must be stored: docs/operate/streams.md."""
THINGS = (TRIGGER, EARLY, CUT, RESULT, MESSAGE) = (
    "the trigger",
    "the early message",
    "the cut",
    "the analysis",
    "the message with the result",
)
KEPT = 10  # s that the last packets have to reach the database
SCALE = 0.5
NOISE = 1e-4  # m/s²


@dataclass(frozen=True, slots=True)
class Kept:
    """The packets as the service has them."""

    stored: int
    refused: int
    missing: float
    """s in gaps, all channels together."""


def recorded() -> dict[str, Vector]:
    """Samples of each channel, SI units."""
    rng, rate = np.random.default_rng(1), round(RATE)
    whole = {}
    for channel, samples in paper_records.records(rng, SCALE).items():
        padded = np.concatenate([np.zeros(BEFORE * rate), samples[: SHAKEN * rate], np.zeros(AFTER * rate)])
        noise = NOISE if channel.endswith("HNX") else 0.01 * NOISE
        whole[channel] = padded + noise * rng.standard_normal(padded.size)
    return whole


def played(samples: dict[str, Vector], begin: float) -> list[tuple[float, bytes]]:
    """Time since 1970 at which each record can be sent, and the record."""
    stream = Stream()
    for channel, values in samples.items():
        codes = dict(zip(("network", "station", "location", "channel"), channel.split("."), strict=True))
        header = {**codes, "starttime": UTCDateTime(begin), "sampling_rate": RATE}
        stream.append(Trace(np.round(values / GAIN).astype(np.int32), header))
    data = miniseed(stream)
    records = [data[at : at + 512] for at in range(0, len(data), 512)]
    return sorted((MS3Record.parse(record).endtime / 1e9, record) for record in records)


def kept(opened: sessionmaker[Session]) -> Kept:
    """The packets in the database so far."""
    with opened() as session:
        state = session.scalars(select(StreamState)).one()
        stored = session.scalar(select(func.count()).select_from(Packet)) or 0
        return Kept(stored, state.refused, sum(one["missing"] for one in state.channels.values()))


def failures(noted: Mapping[str, float], sent: int, found: Kept) -> list[str]:
    """Failures, in sentences.

    Args:
        noted: s after the end of the shaking when each thing was there, by its name; what did not come is left out.
        sent: number of packets that the server sent.
        found: what the service has of them.
    """
    late = [f"{name} did not come within {LONGEST} s after the end" for name in THINGS if name not in noted]
    if (result := noted.get(RESULT, 0.0)) > GOAL:
        late.append(f"the result came {result:.1f} s after the end, and the goal is {GOAL} s")
    if found.stored != sent:
        late.append(f"{found.stored} packets are in the database, and {sent} were sent")
    if found.refused:
        late.append(f"{found.refused} packets could not be used")
    if found.missing:
        late.append(f"{found.missing:.1f} s are missing in the channels together")
    return late


def seen(opened: sessionmaker[Session]) -> dict[str, bool]:
    """State so far."""
    with opened() as session:
        messages = list(session.scalars(select(Message).order_by(Message.id)))
        state = session.scalars(select(StreamState)).one_or_none()
        return {
            TRIGGER: state is not None and bool(state.shaking),
            EARLY: bool(messages),
            CUT: state is not None and bool(state.cuts),
            RESULT: bool(session.scalar(select(func.count()).select_from(Analysis))),
            MESSAGE: any("is_provisional" not in message.data for message in messages),
        }


def play(
    server: SeedLinkServer, opened: sessionmaker[Session], waiting: list[tuple[float, bytes]], begin: float
) -> tuple[dict[str, float], int]:
    """Send the records, and note when each thing was there, in s since 1970; with the number of records sent."""
    noted: dict[str, float] = {}
    sent = 0
    while len(noted) < len(THINGS) and time() < begin + BEFORE + SHAKEN + LONGEST:
        now = [record for at, record in waiting if at <= time()]
        waiting = waiting[len(now) :]
        server.add(now)
        sent += len(now)
        for name, is_there in seen(opened).items():
            if is_there:
                noted.setdefault(name, time())
        sleep(0.1)
    end = time() + KEPT
    while kept(opened).stored < sent and time() < end:
        sleep(0.1)
    return noted, sent


def main() -> int:
    """Play it, and print the times and what failed; the exit code."""
    samples = recorded()
    with tempfile.TemporaryDirectory() as place, seedlink_server("4") as server:
        file = Path(place, "building.toml")
        source = f'[source]\nkind = "seedlink"\nlocation = "{server.address}"\n[isolation]'
        file.write_text(paper_records.building_file().replace("[isolation]", source, 1), "utf-8")
        url = f"sqlite:///{place}/menshin.sqlite"
        environment = {**os.environ, "MENSHIN_DATABASE_URL": url, "MENSHIN_PORT": "0", "MENSHIN_JOBS__WORKERS": "1"}
        menshin = [sys.executable, "-c", "from service.cli import app; app()"]
        subprocess.run([*menshin, "building", "add", str(file)], env=environment, check=True)
        with subprocess.Popen([*menshin, "up"], env=environment, stdout=subprocess.DEVNULL) as service:
            while not server.do("count"):
                sleep(0.1)
            begin = time()
            opened = sessions(url)
            noted, sent = play(server, opened, played(samples, begin), begin)
            found = kept(opened)
            service.terminate()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    after = {name: at - begin - BEFORE - SHAKEN for name, at in noted.items()}
    for name, seconds in after.items():
        print(f"{name:28} {seconds + SHAKEN:6.1f} s from the onset, {seconds:6.1f} s from the end")
    print(f"{found.stored} of {sent} packets kept")
    failed = failures(after, sent, found)
    for one in failed:
        print(f"failed: {one}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
