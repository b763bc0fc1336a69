"""A great earthquake in many buildings: how soon each has its first verdict, in which order, and whether any is lost.

    OMP_NUM_THREADS=1 python -m benchmarks.flood [BUILDINGS] [--processes 1] [--processes 2]

The poller reads one record and puts its earthquake into the queue of a PostgreSQL server in a temporary folder. SQL
copies the building with its file, waveforms and job, and scales each copy's waveforms, so that each is shaken to its
own strength. Then, for each number of processes, `menshin work` drains the queue of a copy of that database and
`menshin notify` sends the messages to a server of this machine. All earthquakes wait when the workers start, which is
harder than if they arrived within ten minutes. The exit code is 1 if an order was wrong or anything was lost.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import perf_counter
from typing import Annotated

import numpy as np
import psutil
import typer
from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the receiving server is the tests'

from receivers import WebhookServer, webhook_server
from rendered_messages import KEY

from benchmarks import city
from core.arrays import Vector
from service.analyses.tables import Analysis
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule, Severity
from service.buildings.tables import Building
from service.db import migrate, sessions as database
from service.jobs.queue import ANALYSE, WATCH
from service.jobs.tables import Job
from service.notify.claims import URGENCY
from service.notify.notifier import AT_ONCE
from service.notify.tables import Delivery, Message
from service.records.tables import Event

GREAT = 10_000
"""Buildings for which the arithmetic is made."""
WEAKEST, STRONGEST = 0.3, 2.5
"""Factors of the recorded shaking among the buildings: from intensities without a limit to those that want action."""
COMMAND = (sys.executable, "-c", "from service.cli import app; app()")


@dataclass(frozen=True, slots=True)
class Drained:
    """One queue that was drained."""

    processes: int
    clock: float
    """s until all was done."""
    spent: float
    """s of processor time of the worker and its processes."""
    server: float
    """s of processor time of the PostgreSQL server."""
    verdicts: Vector
    """(buildings,) s from the start of the workers to each building's first verdict."""
    displaced: int
    """Largest number of places by which an earthquake was claimed before a stronger one."""
    faults: tuple[str, ...]
    """Events that were lost, or came in a wrong order."""

    def __str__(self) -> str:
        median, late, last = np.quantile(self.verdicts, [0.5, 0.95, 1.0])
        each = (self.spent + self.server) / self.verdicts.size
        return (
            f"{self.processes} processes, {self.verdicts.size} buildings: first verdict after {median:.0f} s (median), "
            f"{late:.0f} s (95 %), {last:.0f} s (last) of the clock; {each:.2f} s of processor time for each building, "
            f"{self.server / self.verdicts.size:.2f} s of it PostgreSQL's"
        )


def prepare(url: str, count: int, program: WebhookServer) -> None:
    """Fill a new database with buildings whose earthquake waits for its analysis.

    Args:
        url: of the database.
        count: number of buildings.
        program: where the messages go.
    """
    migrate.upgrade(url)
    sessions, now = database.sessions(url), datetime.now(UTC).replace(microsecond=0)
    city.received(sessions, city.NOWHERE, now, now - timedelta(minutes=10))
    with sessions.begin() as session:
        building = session.scalars(select(Building)).one()
        rule = ReceiverRule("program", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES)
        recipients.add(session, building.id, rule, "engineer", now)
    engine = sessions.kw["bind"]
    city.repeat(engine, count)
    # 7919 and 10007 are primes: the factors are spread evenly and in no order of the buildings.
    factor = f"({WEAKEST} * power({STRONGEST / WEAKEST}, (building_id * 7919 % 10007) / 10007.0))"
    with engine.begin() as connection:
        connection.execute(text(f"UPDATE event SET recorded_peak = recorded_peak * {factor}"))
        of_event = "FROM event WHERE event.id = waveform.event_id"
        connection.execute(text(f"UPDATE waveform SET gain = gain * {factor} {of_event}"))
    engine.dispose()


def drained(url: str, processes: int, count: int, program: WebhookServer, server: psutil.Process) -> Drained:
    """Drain a queue with so many processes, then send the messages."""
    before, of_server = resource.getrusage(resource.RUSAGE_CHILDREN), city.processor_time(server)
    begun, clock = datetime.now(UTC), perf_counter()
    command(url, "work", "--until-idle", "--workers", str(processes))
    clock, after = perf_counter() - clock, resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    of_server = city.processor_time(server) - of_server
    program.posted.clear()
    command(url, "notify", "--until-idle")
    sessions = database.sessions(url)
    with sessions() as session:
        verdicts = first_verdicts(session, begun)
        displaced = displacement(session)
        faults = (*lost(session, count, program), *disordered(program, displaced, processes))
    sessions.kw["bind"].dispose()
    return Drained(processes, clock, spent, of_server, verdicts, displaced, faults)


def command(url: str, *arguments: str) -> None:
    """Run a command of the service to its end."""
    own = {
        "MENSHIN_DATABASE_URL": url,
        "MENSHIN_JOBS__KEPT_ROOM": "0",
        "MENSHIN_NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost"]',
        "MENSHIN_NOTIFY__ALLOW_PLAIN_HTTP": "true",
    }
    with tempfile.TemporaryDirectory(prefix="menshin-flood-") as folder:
        subprocess.run([*COMMAND, *arguments], cwd=folder, env=os.environ | own, check=True, stdout=subprocess.DEVNULL)


def first_verdicts(session: Session, begun: datetime) -> Vector:
    """(buildings,) s until the comparison with earlier earthquakes, which ends with the verdict, was stored."""
    query = select(func.min(Job.finished_at)).where(Job.kind == WATCH, Job.state == "done").group_by(Job.building_id)
    return np.array([(one - begun).total_seconds() for one in session.scalars(query) if one is not None])


def displacement(session: Session) -> int:
    """Largest number of places by which an earthquake ended before a stronger one."""
    query = select(Event.recorded_peak).join(Job, Job.event_id == Event.id)
    return places_early(
        [-(one or 0.0) for one in session.scalars(query.where(Job.kind == ANALYSE).order_by(Job.finished_at))]
    )


def places_early(order: Sequence[float]) -> int:
    """Largest number of places by which one came before its turn; the smallest should come first."""
    turns = np.argsort(np.argsort(order, kind="stable"), kind="stable")
    return int((turns - np.arange(turns.size)).max())


def lost(session: Session, count: int, program: WebhookServer) -> Iterator[str]:
    """Earthquakes without an analysis, buildings without a message, messages that did not arrive once."""
    analysed = session.scalar(select(func.count(Analysis.id)).where(Analysis.current, Analysis.refusal.is_(None)))
    if analysed != count:
        yield f"{analysed} earthquakes of {count} were analysed"
    undone = session.scalar(select(func.count(Job.id)).where(Job.state != "done"))
    if undone:
        yield f"{undone} jobs are not done"
    written = session.scalar(select(func.count(Message.building_id.distinct())))
    if written != count:
        yield f"{written} buildings of {count} have a message"
    waiting = session.scalar(select(func.count(Delivery.id)).where(Delivery.state != "delivered"))
    arrived = [one.headers["webhook-id"] for one in program.posted]
    sent = session.scalars(select(Message.identity)).all()
    if waiting or sorted(arrived) != sorted(sent):
        yield f"{len(arrived)} messages of {len(sent)} arrived, {waiting} deliveries are not over"


def disordered(program: WebhookServer, displaced: int, processes: int) -> Iterator[str]:
    """Analyses out of the order of strength by more than those under way, and messages out of that of severity."""
    if displaced > processes:
        yield f"an earthquake was analysed {displaced} places before its turn"
    early = places_early([URGENCY[one] for one in severities(program)])
    if early > AT_ONCE:
        yield f"a message left {early} places before its turn"


def severities(program: WebhookServer) -> Sequence[Severity]:
    """Severities of the messages in the order in which they arrived."""
    return [json.loads(one.body)["data"]["severity"] for one in program.posted]


def arithmetic(found: Drained) -> str:
    """Extrapolation from the processor time of one building to a great earthquake; nothing of it was run."""
    each = (found.spent + found.server) / found.verdicts.size
    hours = "; ".join(f"{cores} cores {GREAT * each / cores / 60:.0f} min" for cores in (2, 4, 16, 64))
    return f"arithmetic, not measured: {GREAT} buildings x {each:.2f} s of processor time / cores: {hours}"


def main(
    buildings: Annotated[int, typer.Argument(help="Number of buildings.")] = 100,
    processes: Annotated[list[int] | None, typer.Option(help="Numbers of processes, one run for each.")] = None,
) -> None:
    """A line for each number of processes, and arithmetic for a great earthquake."""
    faults: list[str] = []
    with city.server() as url, webhook_server() as program:
        prepare(url, buildings, program)
        server = city.server_process(url)
        for number in processes or [1, 2]:
            copy = city.copied(url, f"flood_{number}")
            found = drained(copy, number, buildings, program, server)
            print(found, flush=True)
            of = severities(program)
            counts = ", ".join(f"{of.count(one)} {one}" for one in dict.fromkeys(of))
            print(f"    messages in the order of arrival: {counts}; {arithmetic(found)}", flush=True)
            for fault in found.faults:
                print(f"    WRONG: {fault}", flush=True)
            faults += found.faults
    raise typer.Exit(1 if faults else 0)


if __name__ == "__main__":
    typer.run(main)
