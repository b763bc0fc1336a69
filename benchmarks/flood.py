"""A great earthquake in many buildings: how soon each has its first verdict, in which order, and whether any is lost.

    OMP_NUM_THREADS=1 python -m benchmarks.flood [BUILDINGS] [--processes 1] [--processes 2] [--executor dask]

The poller reads one record and puts its earthquake into the queue of a PostgreSQL server in a temporary folder. SQL
copies the building with its file, waveforms and job, and scales each copy's waveforms, so that each is shaken to its
own strength. Then, for each number of processes, `menshin work` drains the queue of a copy of that database and
`menshin notify` sends the messages to a server of this machine. All earthquakes wait when the workers start, which is
harder than if they arrived within ten minutes; `benchmarks/flood_arriving.py` lets them arrive. With `--executor dask`
the processes are workers of a Dask cluster on this machine, which was started before. The exit code is 1 if an order
was wrong or anything was lost.
"""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Annotated

import numpy as np
import psutil
import typer
from sqlalchemy import func, select, text
from sqlalchemy.orm import Session

from benchmarks import city, commands, flood_parts
from benchmarks.flood_parts import SETTINGS, Executor, Kind, WebhookServer
from core.arrays import Vector
from service.buildings.tables import Building
from service.db import migrate, sessions as database
from service.jobs.queue import WATCH
from service.jobs.tables import Job

WEAKEST, STRONGEST = 0.3, 20.0
"""Factors of the recorded shaking among the buildings: from intensities without a limit to those that want action."""


@dataclass(frozen=True, slots=True)
class Drained:
    """One queue that was drained."""

    executor: Executor
    spent: float
    """s of processor time of the worker and its processes."""
    server: float
    """s of processor time of the PostgreSQL server."""
    others: float
    """Cores that all else on the machine used meanwhile."""
    verdicts: Vector
    """(buildings,) s from the start of the worker to each building's first verdict."""
    faults: tuple[str, ...]
    """Events that were lost, or came in a wrong order."""

    @property
    def each(self) -> float:
        """s of processor time for each building."""
        return (self.spent + self.server) / self.verdicts.size

    def __str__(self) -> str:
        median, late, last = np.quantile(self.verdicts, [0.5, 0.95, 1.0])
        return (
            f"{self.executor}, {self.verdicts.size} buildings: first verdict after {median:.0f} s (median), "
            f"{late:.0f} s (95 %), {last:.0f} s (last) of the clock; {self.each:.2f} s of processor time for each "
            f"building, {self.server / self.verdicts.size:.2f} s of it PostgreSQL's; all else used {self.others:.1f} "
            "cores"
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
        flood_parts.add_program(session, session.scalars(select(Building)).one(), program, now)
    engine = sessions.kw["bind"]
    city.repeat(engine, count)
    # 7919 and 10007 are primes: the factors are spread evenly and in no order of the buildings.
    factor = f"({WEAKEST} * power({STRONGEST / WEAKEST}, (building_id * 7919 % 10007) / 10007.0))"
    with engine.begin() as connection:
        connection.execute(text(f"UPDATE event SET recorded_peak = recorded_peak * {factor}"))
        of_event = "FROM event WHERE event.id = waveform.event_id"
        connection.execute(text(f"UPDATE waveform SET gain = gain * {factor} {of_event}"))
    engine.dispose()


def drained(url: str, executor: Executor, count: int, program: WebhookServer, server: psutil.Process) -> Drained:
    """Drain a queue, then send the messages."""
    busy, of_server, of_cluster = commands.busy(), city.processor_time(server), commands.used(executor.processes)
    begun = datetime.now(UTC)
    spent = commands.run(url, "work", "--until-idle", *executor.arguments, **SETTINGS)
    spent += commands.used(executor.processes) - of_cluster
    of_server = city.processor_time(server) - of_server
    others = (commands.busy() - busy - spent - of_server) / (datetime.now(UTC) - begun).total_seconds()
    program.posted.clear()
    commands.run(url, "notify", "--until-idle", **SETTINGS)
    sessions = database.sessions(url)
    with sessions() as session:
        verdicts = first_verdicts(session, begun)
        analyses, messages = flood_parts.of_analyses(session, is_all_waiting=True), flood_parts.of_messages(session)
        wrong = flood_parts.disordered(analyses, messages, executor.count)
        faults = (*flood_parts.lost(session, count, program), *wrong)
    sessions.kw["bind"].dispose()
    return Drained(executor, spent, of_server, others, verdicts, faults)


def first_verdicts(session: Session, begun: datetime) -> Vector:
    """(buildings,) s until the comparison with earlier earthquakes, which ends with the verdict, was stored."""
    query = select(func.min(Job.finished_at)).where(Job.kind == WATCH, Job.state == "done").group_by(Job.building_id)
    return np.array([(one - begun).total_seconds() for one in session.scalars(query) if one is not None])


def main(
    buildings: Annotated[int, typer.Argument(help="Number of buildings.")] = 100,
    processes: Annotated[list[int] | None, typer.Option(help="Numbers of processes, one run for each.")] = None,
    executor: Annotated[Kind, typer.Option(help="Where earthquakes are analysed.")] = Kind.LOCAL,
) -> None:
    """A line for each number of processes, and arithmetic for a great earthquake."""
    faults: list[str] = []
    with city.server() as url, flood_parts.program() as program:
        prepare(url, buildings, program)
        server = city.server_process(url)
        for number in processes or [1, 2]:
            copy = city.copied(url, f"flood_{number}")
            with flood_parts.executor(executor, number) as started:
                found = drained(copy, started, buildings, program, server)
            print(found, flush=True)
            arrived, extrapolated = flood_parts.severities(program), flood_parts.arithmetic(found.each)
            print(f"    messages in the order of arrival: {arrived}; {extrapolated}", flush=True)
            for fault in found.faults:
                print(f"    WRONG: {fault}", flush=True)
            faults += found.faults
    raise typer.Exit(1 if faults else 0)


if __name__ == "__main__":
    typer.run(main)
