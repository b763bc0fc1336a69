"""Common parts of both floods of earthquakes: the recipient, the processes that analyse, and what may not happen.

An earthquake may not be lost, nor served before a more urgent one that waits.
"""

import json
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from functools import partial
from pathlib import Path
from time import sleep
from types import MappingProxyType

import psutil
from sqlalchemy import func, select
from sqlalchemy.orm import Session

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the receiving server is the tests'

from receivers import WebhookServer, webhook_server
from rendered_messages import KEY

from benchmarks import commands
from benchmarks.queue_order import Order, order
from service.analyses.tables import Analysis
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building
from service.jobs.queue import ANALYSE
from service.jobs.tables import Job
from service.notify.claims import URGENCY
from service.notify.tables import Delivery, DeliveryAttempt, Message
from service.records.tables import Event

GREAT = 10_000
"""Buildings for which the arithmetic is made."""
CORES = (2, 4, 16, 64)
"""Numbers of cores for which it is made."""
SETTINGS: Mapping[str, str] = MappingProxyType(
    {
        "JOBS__KEPT_ROOM": "0",
        "NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost"]',
        "NOTIFY__ALLOW_PLAIN_HTTP": "true",
    }
)
"""Settings of the service: no result is kept for a later run, and messages may go to this machine."""


class Kind(StrEnum):
    """Kind of process that analyses earthquakes."""

    LOCAL = "local"
    DASK = "dask"


@dataclass(frozen=True, slots=True)
class Executor:
    """Processes that analyse earthquakes."""

    kind: Kind
    count: int
    arguments: Sequence[str]
    """Arguments of `menshin work`."""
    processes: Sequence[psutil.Process]
    """Its processes that `menshin work` does not start."""

    def __str__(self) -> str:
        return f"{self.count} Dask workers" if self.kind is Kind.DASK else f"{self.count} processes"


@contextmanager
def executor(kind: Kind, count: int) -> Iterator[Executor]:
    """So many processes of `menshin work`, which starts them, or of a Dask cluster, which runs meanwhile."""
    own = ("--workers", str(count))
    if kind is Kind.LOCAL:
        yield Executor(kind, count, own, ())
        return
    with commands.dask_cluster(count) as (address, processes):
        yield Executor(kind, count, (*own, "--executor", "dask", "--dask-address", address), processes)


@contextmanager
def program(seconds: float = 0.0) -> Iterator[WebhookServer]:
    """A recipient that keeps what it receives, and takes so long to accept a message."""
    with webhook_server() as made:
        made.meanwhile = partial(sleep, seconds)
        yield made


def add_program(session: Session, building: Building, program: WebhookServer, now: datetime) -> None:
    """Send all messages about a building to a program."""
    rule = ReceiverRule("program", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES)
    recipients.add(session, building.id, rule, "engineer", now)


def severities(program: WebhookServer) -> str:
    """Numbers of messages by severity, in words; the severity that arrived first comes first."""
    of = Counter(json.loads(one.body)["data"]["severity"] for one in program.posted)
    return ", ".join(f"{count} {severity}" for severity, count in of.items())


def arithmetic(each: float) -> str:
    """Extrapolation to a great earthquake from s of processor time for each building; nothing of it was run."""
    hours = "; ".join(f"{cores} cores {GREAT * each / cores / 60:.0f} min" for cores in CORES)
    return f"arithmetic, not measured: {GREAT} buildings x {each:.2f} s of processor time / cores: {hours}"


def of_analyses(session: Session, *, is_all_waiting: bool) -> Order:
    """Order of the earthquakes by strength.

    Args:
        session: of the database.
        is_all_waiting: True if all waited when the first one was taken. Otherwise only those are compared that came
            before the other one came, because it is not stored when an earthquake was taken.
    """
    query = select(Event.recorded_peak, Job.created_at, Job.finished_at).join(Job, Job.event_id == Event.id)
    rows = session.execute(query.where(Job.kind == ANALYSE, Job.finished_at.is_not(None))).tuples().all()
    came, ended = [one[1] for one in rows], [one[2] for one in rows]
    return order([-(one[0] or 0.0) for one in rows], came, ended if is_all_waiting else came, ended)


def of_messages(session: Session) -> Order:
    """Order of the first attempts to deliver, by severity."""
    query = select(Message.severity, Delivery.created_at, func.min(DeliveryAttempt.begun_at))
    query = query.join(Delivery, Delivery.message_id == Message.id).join(DeliveryAttempt)
    rows = session.execute(query.group_by(Delivery.id, Message.severity)).tuples().all()
    begun = [one[2] for one in rows]
    return order([URGENCY[one[0]] for one in rows], [one[1] for one in rows], begun, begun)


def disordered(analyses: Order, messages: Order, processes: int) -> Iterator[str]:
    """Analyses before stronger ones, more than those under way explain, and messages before more urgent ones."""
    if analyses.places > processes:
        yield f"an earthquake was analysed before {analyses.places} stronger ones that waited"
    if messages.places:
        yield f"a message was sent before {messages.places} more urgent ones that waited"


def lost(session: Session, count: int, program: WebhookServer, unusable: int = 0) -> Iterator[str]:
    """Earthquakes without an analysis, buildings without a message, messages that did not arrive once.

    Args:
        session: of the database.
        count: number of buildings, of one earthquake each.
        program: recipient of all messages.
        unusable: number of the buildings whose records nothing can be estimated from.
    """
    analysed = session.scalar(select(func.count(Analysis.id)).where(Analysis.current, Analysis.refusal.is_(None)))
    refused = session.scalar(select(func.count(Analysis.id)).where(Analysis.current, Analysis.refusal.is_not(None)))
    if (analysed, refused) != (count - unusable, unusable):
        yield f"of {count} earthquakes, {unusable} of them unusable, {analysed} were analysed and {refused} refused"
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
