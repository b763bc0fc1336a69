"""A great earthquake whose records arrive while the service runs: from each record to its verdict and its message.

    OMP_NUM_THREADS=1 python -m benchmarks.flood_arriving [BUILDINGS] [--minutes 2] [--processes 2] [--executor dask]

Each building has a source of its own on an HTTP server of this machine. `menshin poll`, `menshin work` and `menshin
notify` run with the settings of a new installation on a PostgreSQL server in a temporary folder. Once they have polled
every source and are at rest, one record after the other arrives at the sources: ten channels of `menshin demo`, for
motions of the ground of seven strengths; in each eighth building the slab above the isolators records zeros. Messages
go to a server of this machine, which with `--answering SECONDS` takes so long to accept each, so that messages wait.
The exit code is 1 if an order was wrong or anything was lost.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler
from math import inf
from multiprocessing import Value
from pathlib import Path
from time import perf_counter, sleep, time
from typing import Annotated, Protocol

import numpy as np
import psutil
import typer
from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session, sessionmaker

from benchmarks import arrivals, city, commands, flood_parts
from benchmarks.flood_parts import SETTINGS, Executor, Kind, WebhookServer
from benchmarks.queue_order import Order
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db import migrate, sessions as database
from service.demo.site import BASE, CODE, SENSORS
from service.notify.tables import Delivery, Message
from service.records.tables import Recording, SourceState

PEAKS = (0.2, 0.4, 0.7, 1.5, 3.0, 5.0, 7.0)
"""m/s², of the ground. The last two move the isolators so far that an inspection is due, which is an alarm."""
SILENT = 1.0
"""m/s², of the ground where the slab records zeros: nothing can be estimated, which is a warning."""
APART = 5
"""Buildings that follow each other have strengths so many places apart."""
LONGEST = 3600.0
"""s until a run is given up."""
LOOK = 5.0
"""s between two looks at the processor time of the parts."""
RESTING = 0.1
"""Cores that all parts together use at most while nothing arrives."""


class Moment(Protocol):
    """A number that processes share."""

    value: float
    """s since 1970; infinite before anything arrives."""


@dataclass(frozen=True, slots=True)
class Steps:
    """Times of the record of one building and of what followed from it, s since 1970."""

    severity: str
    """Severity of its message."""
    arrived: float
    stored: float
    verdict: float
    """Storage of the verdict, with the message about it."""
    message: float
    """Acceptance by its recipient."""


@dataclass(frozen=True, slots=True)
class Passed:
    """A flood that has passed through the service."""

    executor: Executor
    minutes: float
    """Time within which the records arrived."""
    steps: tuple[Steps, ...]
    spent: dict[str, float]
    """s of processor time since the first record arrived, by part of the service."""
    others: float
    """Cores that all else on the machine used meanwhile, this benchmark and its servers included."""
    messages: Order
    analyses: Order
    faults: tuple[str, ...]
    """Losses and wrong orders, in sentences."""

    @property
    def each(self) -> float:
        """s of processor time for each building."""
        return sum(self.spent.values()) / len(self.steps)

    def __str__(self) -> str:
        each = ", ".join(f"{1e3 * one / len(self.steps):.0f} ms {name}" for name, one in self.spent.items())
        lines = [
            f"{self.executor}, {len(self.steps)} buildings within {self.minutes:g} min; s by the clock from the "
            "record's arrival, median, 95 %, longest:",
            *(f"    {name:24} {line}" for name, line in self._lines()),
            f"    from the first arrival to the last message: {self._span():.0f} s",
            f"    processor time for each building: {self.each:.2f} s: {each}; all else used {self.others:.1f} cores",
            f"    pairs of analyses in which the stronger one did not come first and was preferred: "
            f"{self.analyses.preferred}; of messages, the more urgent one: {self.messages.preferred}",
            f"    {flood_parts.arithmetic(self.each)}",
        ]
        return "\n".join(lines)

    def _lines(self) -> list[tuple[str, str]]:
        every = self.steps
        found = [
            ("stored", _quantiles([one.stored - one.arrived for one in every])),
            ("verdict", _quantiles([one.verdict - one.arrived for one in every])),
            ("message", _quantiles([one.message - one.arrived for one in every])),
        ]
        for severity in sorted({one.severity for one in every}):
            of = [one.message - one.arrived for one in every if one.severity == severity]
            found.append((f"message, {len(of)} {severity}", _quantiles(of)))
        return found

    def _span(self) -> float:
        return max(one.message for one in self.steps) - min(one.arrived for one in self.steps)


def _quantiles(seconds: Sequence[float]) -> str:
    return " ".join(f"{one:6.1f}" for one in np.quantile(seconds, [0.5, 0.95, 1.0]))


def template_of(number: int) -> int:
    """Place of a building's record among all records."""
    return number * APART % (len(PEAKS) + 1)


def number_of(code: str) -> int:
    """Place of a building among all, by its code."""
    return 0 if code == CODE else int(code[1:])


def records(day: datetime) -> list[bytes]:
    """The miniSEED of an earthquake of each strength, and of one whose slab recorded zeros."""
    of_slab = [one.id for one in SENSORS if (one.level, one.quantity) == (BASE, "acceleration")]
    return [*(arrivals.great_record(day, one) for one in PEAKS), arrivals.great_record(day, SILENT, of_slab)]


def sources(templates: Sequence[bytes], begin: Moment, apart: float) -> type[BaseHTTPRequestHandler]:
    """Answers of a server that has a folder for each building's code, where a file appears at its time."""

    def listed(code: str) -> list[str]:
        return [arrivals.NAME] if time() >= begin.value + number_of(code) * apart else []

    return city.folders(listed, lambda code: arrivals.of_station(templates[template_of(number_of(code))], code))


def prepare(url: str, count: int, source: str, program: WebhookServer, now: datetime) -> None:
    """Fill a new database with buildings without an earthquake."""
    migrate.upgrade(url)
    sessions = database.sessions(url)
    with sessions.begin() as session:
        building = building_store.add(session, arrivals.described(), Path("/"), now - timedelta(days=30))
        flood_parts.add_program(session, building, program, now)
    engine = sessions.kw["bind"]
    city.repeat(engine, count)
    arrivals.give_sources(engine, source)
    engine.dispose()


def passed(url: str, executor: Executor, count: int, minutes: float, begin: Moment, program: WebhookServer) -> Passed:
    """Let all records arrive while the service runs."""
    sessions, server = database.sessions(url), city.server_process(url)
    with ExitStack() as stack:
        parts = {
            "poller": [stack.enter_context(commands.running(url, "poll", **SETTINGS))],
            "worker": [stack.enter_context(commands.running(url, "work", *executor.arguments, **SETTINGS))],
            "notifier": [stack.enter_context(commands.running(url, "notify", **SETTINGS))],
            "PostgreSQL": [server],
        }
        parts["worker"] += executor.processes
        wait_for(sessions, select(func.count(SourceState.succeeded_at)), count)
        wait_for_rest(parts)
        before = {name: commands.used(processes) for name, processes in parts.items()}
        busy, begin.value = commands.busy(), time()
        wait_for(sessions, delivered(), count)
        clock, busy = time() - begin.value, commands.busy() - busy
        spent = {name: commands.used(processes) - before[name] for name, processes in parts.items()}
    with sessions() as session:
        found = tuple(steps(session, begin.value, 60 * minutes / count))
        analyses, messages = flood_parts.of_analyses(session, is_all_waiting=False), flood_parts.of_messages(session)
        unusable = sum(template_of(number) == len(PEAKS) for number in range(count))
        wrong = flood_parts.disordered(analyses, messages, executor.count)
        faults = (*flood_parts.lost(session, count, program, unusable), *wrong)
    sessions.kw["bind"].dispose()
    others = (busy - sum(spent.values())) / clock
    return Passed(executor, minutes, found, spent, others, messages, analyses, faults)


def wait_for(sessions: sessionmaker[Session], counted: Select[int], count: int) -> None:
    """Wait until so many are counted, LONGEST at most."""
    clock = perf_counter()
    while perf_counter() - clock < LONGEST:
        with database.reading(sessions)() as session:
            if (session.scalar(counted) or 0) >= count:
                return
        sleep(0.5)


def wait_for_rest(parts: Mapping[str, Sequence[psutil.Process]]) -> None:
    """Wait until the parts have loaded what they need, and use little processor time, LONGEST at most."""
    clock, before = perf_counter(), -inf
    while perf_counter() - clock < LONGEST:
        spent = sum(commands.used(processes) for processes in parts.values())
        if spent - before < RESTING * LOOK:
            return
        before = spent
        sleep(LOOK)


def delivered() -> Select[int]:
    """Number of the buildings whose recipient has accepted a message."""
    buildings = func.count(Message.building_id.distinct())
    return select(buildings).join(Delivery, Delivery.message_id == Message.id).where(Delivery.state == "delivered")


def steps(session: Session, begin: float, apart: float) -> Iterator[Steps]:
    """Times of each building whose first message was accepted."""
    read = select(Recording.building_id, func.min(Recording.received_at)).group_by(Recording.building_id)
    first = select(func.min(Message.id)).group_by(Message.building_id)
    sent = select(Building.code, Message, Delivery.finished_at).join(Message.building)
    sent = sent.join(Delivery, Delivery.message_id == Message.id).where(Message.id.in_(first))
    reads = dict(session.execute(read).tuples().all())
    for code, message, accepted in session.execute(sent).tuples():
        if accepted is not None:
            times = (one.timestamp() for one in (reads[message.building_id], message.created_at, accepted))
            yield Steps(message.severity, begin + number_of(code) * apart, *times)


def main(
    buildings: Annotated[int, typer.Argument(min=2, help="Number of buildings.")] = 120,
    minutes: Annotated[float, typer.Option(help="Time within which the records arrive.")] = 2.0,
    processes: Annotated[int, typer.Option(help="Number of processes that analyse.")] = 2,
    executor: Annotated[Kind, typer.Option(help="Where earthquakes are analysed.")] = Kind.LOCAL,
    answering: Annotated[float, typer.Option(help="s that the recipient takes to accept a message.")] = 0.0,
) -> None:
    """The times from a record's arrival to its verdict and message, and arithmetic for a great earthquake."""
    now = datetime.now(UTC).replace(microsecond=0)
    begin = Value("d", inf)
    handler = sources(records(now - timedelta(minutes=10)), begin, 60 * minutes / buildings)
    with (
        city.server() as url,
        city.monitoring_server(handler) as source,
        flood_parts.program(answering) as program,
        flood_parts.executor(executor, processes) as started,
    ):
        prepare(url, buildings, source, program, now)
        found = passed(url, started, buildings, minutes, begin, program)
        print(found, flush=True)
        print(f"    messages in the order of arrival: {flood_parts.severities(program)}")
    for fault in found.faults:
        print(f"    WRONG: {fault}", flush=True)
    raise typer.Exit(1 if found.faults else 0)


if __name__ == "__main__":
    typer.run(main)
