"""Summary of a run by names that are equal in every run, and the differences between two runs."""

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import orjson
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert
from service.analyses.tables import Analysis, DirectionResult
from service.buildings.tables import Building
from service.jobs.tables import Job
from service.notify.tables import Delivery, Message, Receiver
from service.records.tables import Event, Recording, Waveform

FINISHED, ENDED = ("done", "cancelled"), ("delivered", "dropped")
"""Final states of a job and of a delivery that indicate no problem."""
Receipts = Mapping[str, Sequence[bool]]
"""For each message identity, in order of arrival: True if that copy was marked as a repeat."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Contents of the database after a run."""

    recordings: Counter[str] = field(default_factory=Counter)
    """Number of recordings by building, file name and state."""
    events: Counter[str] = field(default_factory=Counter)
    """Number of events by building, start, state and number of waveforms."""
    analyses: Counter[str] = field(default_factory=Counter)
    """Number of current analyses by building, start and digest of the result."""
    alerts: Counter[str] = field(default_factory=Counter)
    """Number of alerts by building, cause and state."""
    messages: Counter[str] = field(default_factory=Counter)
    """The first message about each subject, by building and subject."""
    unfinished: tuple[str, ...] = ()
    """Jobs and deliveries that are unfinished or failed."""
    outbox: Mapping[str, frozenset[str]] = field(default_factory=dict)
    """Message identities by kind of recipient."""
    superseded: int = 0
    """Number of analyses that a later one replaced."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A difference between the run with kills and the one without."""

    kind: str
    """`lost`, `doubled`, `stuck`, `left` or `wrong`."""
    subject: str


def outcome(session: Session) -> Outcome:
    """The present contents of the database."""
    codes = {one.id: one.code for one in session.scalars(select(Building))}
    events = {one.id: one for one in session.scalars(select(Event))}
    names = {one.id: f"{codes[one.building_id]} {one.start:%Y-%m-%dT%H:%M:%S}" for one in events.values()}
    alerts = {one.id: one for one in session.scalars(select(Alert))}
    pieces = Counter(session.scalars(select(Waveform.event_id)))
    subjects = {f"event/{number}": name for number, name in names.items()}
    subjects |= {f"alert/{one.id}": f"{codes[one.building_id]} {one.cause}" for one in alerts.values()}
    outbox: dict[str, set[str]] = defaultdict(set)
    for identity, kind in session.execute(
        select(Message.identity, Receiver.kind).join(Message.deliveries).join(Delivery.receiver)
    ):
        outbox[kind].add(identity)
    return Outcome(
        Counter(f"{codes[one.building_id]} {one.name} {one.state}" for one in session.scalars(select(Recording))),
        Counter(f"{names[one.id]} {one.state} {pieces[one.id]}" for one in events.values()),
        Counter(
            f"{names[one.event_id]} {_digest(session, one)}"
            for one in session.scalars(select(Analysis).where(Analysis.current))
        ),
        Counter(f"{codes[one.building_id]} {one.cause} {one.state}" for one in alerts.values()),
        Counter(
            f"{one.kind} {subjects.get(one.key, one.key)}"
            for one in session.scalars(select(Message).where(Message.number == 1))
        ),
        tuple(_unfinished(session)),
        {kind: frozenset(identities) for kind, identities in outbox.items()},
        len(session.scalars(select(Analysis.id).where(~Analysis.current)).all()),
    )


def _digest(session: Session, analysis: Analysis) -> str:
    """Digest of the numbers of an analysis."""
    found = session.execute(
        select(DirectionResult.direction, DirectionResult.peak_force, DirectionResult.force_std)
        .where(DirectionResult.analysis_id == analysis.id)
        .order_by(DirectionResult.direction)
    )
    numbers = [analysis.refusal, sorted(analysis.inputs), analysis.peaks, analysis.pga, [list(row) for row in found]]
    return hashlib.sha256(orjson.dumps(numbers, option=orjson.OPT_SORT_KEYS)).hexdigest()[:12]


def _unfinished(session: Session) -> Iterator[str]:
    for job in session.scalars(select(Job).where(Job.state.not_in(FINISHED)).order_by(Job.id)):
        yield f"job {job.id} ({job.kind}) is {job.state}: {job.error or job.refusal or 'no error'}"
    for delivery in session.scalars(select(Delivery).where(Delivery.state.not_in(ENDED)).order_by(Delivery.id)):
        answers = [one.answer or "no answer" for one in delivery.attempts]
        last = f", the last: {answers[-1]}" if answers else ""
        yield f"delivery {delivery.id} is {delivery.state} after {len(answers)} attempts{last}"


def differences(
    calm: Outcome, chaos: Outcome, received: Mapping[str, Receipts], left: Sequence[str]
) -> Iterator[Difference]:
    """Data lost or duplicated, unfinished work, and processes left by the run with kills.

    Args:
        calm: of the run without kills.
        chaos: of the run with kills.
        received: messages received in the run with kills, by kind of recipient.
        left: names of processes that were still running after the run.
    """
    for table in ("recordings", "events", "analyses", "alerts", "messages"):
        wanted, found = getattr(calm, table), getattr(chaos, table)
        yield from (Difference("lost", f"{table}: {name}") for name in sorted((wanted - found).elements()))
        yield from (Difference("doubled", f"{table}: {name}") for name in sorted((found - wanted).elements()))
    yield from (Difference("stuck", name) for name in chaos.unfinished)
    for kind in sorted(chaos.outbox.keys() | received.keys()):
        sent, got = chaos.outbox.get(kind, frozenset()), received.get(kind, {})
        yield from (Difference("lost", f"{kind}: {identity}") for identity in sorted(sent - got.keys()))
        yield from (
            Difference("doubled", f"{kind}: {identity} is no message") for identity in sorted(got.keys() - sent)
        )
        for identity, repeats in sorted(got.items()):
            if not all(repeats[1:]):
                yield Difference("doubled", f"{kind}: {identity} came again and did not say so")
    yield from (Difference("left", name) for name in left)
