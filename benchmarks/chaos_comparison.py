"""What a database holds after a run and what recipients got, by names that no run changes, and what differs."""

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
"""States of a job and of a delivery that nothing is wrong with."""
Receipts = Mapping[str, Sequence[bool]]
"""Of each identity in the order of arrival, whether it said that it may be a repeat."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run left behind."""

    recordings: Counter[str] = field(default_factory=Counter)
    """By building, name and state."""
    events: Counter[str] = field(default_factory=Counter)
    """By building, start, state and number of waveforms."""
    analyses: Counter[str] = field(default_factory=Counter)
    """The current ones, by building, start and a digest of the result."""
    alerts: Counter[str] = field(default_factory=Counter)
    """By building, cause and state."""
    messages: Counter[str] = field(default_factory=Counter)
    """The first of each subject, by building and subject."""
    unfinished: tuple[str, ...] = ()
    """Jobs and deliveries that did not end well."""
    outbox: Mapping[str, frozenset[str]] = field(default_factory=dict)
    """Identities of the messages for each kind of recipient."""
    superseded: int = 0
    """Analyses that are not current."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One thing that is not as it should be."""

    kind: str
    """`lost`, `doubled`, `stuck` or `left`."""
    subject: str


def outcome(session: Session) -> Outcome:
    """Of the database as it is."""
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
    """Of the numbers of a result."""
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
        yield f"delivery {delivery.id} is {delivery.state}"


def differences(
    calm: Outcome, chaos: Outcome, received: Mapping[str, Receipts], left: Sequence[str]
) -> Iterator[Difference]:
    """All that the run with kills lost, doubled, did not end, or left.

    Args:
        received: what each kind of recipient got in the run with kills.
        left: names of processes that outlived the run.
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
