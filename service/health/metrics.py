"""Metrics for Prometheus: the duration of requests, and the state of the service as stored.

A scrape takes the same number of statements however many buildings there are. Rows of the history are counted in
indexes alone.
"""

import time
from collections.abc import Callable, Collection, Mapping
from datetime import UTC, datetime
from functools import cache

from prometheus_client import CollectorRegistry, Histogram, generate_latest
from prometheus_client.registry import Collector
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.alerts.tables import Alert
from service.analyses.tables import Analysis
from service.buildings.queries import latest_revision
from service.buildings.store import parsed
from service.buildings.tables import Building
from service.db.process_leases import NOTIFYING, POLLING, WORKING
from service.db.select import Question
from service.jobs.tables import Job, Lease
from service.notify.tables import Delivery, Receiver
from service.records.streams import flow
from service.records.streams.flow import Flow
from service.records.tables import READ, REJECTED, Event, Recording, SourceState, StreamState
from service.verdict import levels

Counted = Mapping[str, float]
"""A number by label; by the empty label where there is one number."""
COUNT = func.count().label("count")
ESCAPED = str.maketrans({"\\": r"\\", "\n": r"\n", '"': r"\""})
"""Characters of a label's value that the format writes otherwise."""
SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


PROCESSES: Mapping[str, str] = {POLLING: "poller", WORKING: "worker", NOTIFYING: "notifier"}
"""Processes that hold a lease while they live, by the name of the lease."""


def leases(session: Session) -> Counted:
    """Unix time of the end of the leases of living processes, by process."""
    rows = session.execute(select(Lease.name, Lease.until).where(Lease.name.in_(PROCESSES)))
    return {PROCESSES[name]: until.timestamp() for name, until in rows}


def waiting_workers(session: Session) -> Counted:
    """1 while the worker waits for its Dask cluster, 0 while it can compute; empty without a worker."""
    troubles = session.scalars(select(Lease.trouble).where(Lease.name == WORKING)).all()
    return {"": float(troubles[0] is not None)} if troubles else {}


def events_by_state(session: Session) -> Counted:
    """Number of events by state."""
    return _counted(session, select(Event.state, func.count()).group_by(Event.state))


def jobs_by_state(session: Session) -> Counted:
    """Number of jobs by state."""
    return _counted(session, select(Job.state, func.count()).group_by(Job.state))


def oldest_waiting_job(session: Session) -> Counted:
    """Unix time of the oldest waiting job; empty if none waits."""
    earliest = session.scalar(select(func.min(Job.created_at)).where(Job.state == "waiting"))
    return {} if earliest is None else {"": earliest.timestamp()}


def last_good_records(session: Session) -> Counted:
    """Unix time at which the last record that could be read ends, by code of the building."""
    last = select(func.max(Recording.end)).where(Recording.building_id == Building.id, READ).scalar_subquery()
    return _times(session, select(Building.code, last))


def failing_sources(session: Session) -> Counted:
    """Unix time since which the source has been failing, by code of the building; sources that answer are omitted."""
    query = select(Building.code, SourceState.failing_since).where(SourceState.failing_since.is_not(None))
    return _times(session, query.join(SourceState, SourceState.building_id == Building.id))


def stream_packets(session: Session) -> Counted:
    """Unix time at which the last packet of a live stream came, by code of the building."""
    query = select(Building.code, StreamState.received_at)
    return _times(session, query.join(StreamState, StreamState.building_id == Building.id))


def stream_latencies(session: Session) -> Counted:
    """s by which the slowest channel of a live stream lies behind now, by code of the building."""
    return latencies(session, datetime.now(UTC))


def latencies(session: Session, now: datetime) -> Counted:
    """The same at any time. A channel of the description that never came counts from the connection."""
    query = latest_revision().add_columns(StreamState).join(StreamState, StreamState.building_id == Building.id)
    flows = {row.Building.code: flow.of_stream(row.StreamState, parsed(row.Revision)) for row in session.execute(query)}
    return {code: max(one.latency(now) for one in channels.values()) for code, channels in flows.items() if channels}


def stream_gaps(session: Session) -> Counted:
    """Number of gaps in all channels of a live stream, by code of the building."""
    return _of_streams(session, lambda flows: float(sum(one.gaps for one in flows)))


def stream_missing(session: Session) -> Counted:
    """s missing in all channels of a live stream together, by code of the building."""
    return _of_streams(session, lambda flows: sum(one.missing for one in flows))


def stream_refused(session: Session) -> Counted:
    """Number of packets of a live stream that could not be used, by code of the building."""
    query = select(Building.code, StreamState.refused)
    return _counted(session, query.join(StreamState, StreamState.building_id == Building.id))


def _of_streams(session: Session, value: Callable[[Collection[Flow]], float]) -> Counted:
    query = select(Building.code, StreamState.channels).join(StreamState, StreamState.building_id == Building.id)
    return {code: value(flow.read(channels).values()) for code, channels in session.execute(query)}


def verdicts(session: Session) -> Counted:
    """Rank of the verdict by code of the building, as its facts last changed; 0 is normal, 5 act."""
    return {code: float(rank) for code, rank in levels.ranks_by_code(session).items()}


def open_alerts(session: Session) -> Counted:
    """Number of alerts that have not ended, by code of the building."""
    return _by_building(session, select(Alert.building_id, COUNT).where(Alert.closed_at.is_(None)))


def refused_recordings(session: Session) -> Counted:
    """Number of rejected files, by code of the building."""
    return _by_building(session, select(Recording.building_id, COUNT).where(REJECTED))


def analyses_by_outcome(session: Session) -> Counted:
    """Number of analyses with a result, and of those that rejected their event."""
    refused = session.scalar(select(func.count()).select_from(Analysis).where(Analysis.refusal.is_not(None))) or 0
    every = session.scalar(select(func.count()).select_from(Analysis)) or 0
    return {name: float(count) for name, count in (("refused", refused), ("result", every - refused)) if count}


def deliveries_by_state(session: Session) -> Counted:
    """Number of messages on their way to one receiver each, by state."""
    return _counted(session, select(Delivery.state, func.count()).group_by(Delivery.state))


def oldest_waiting_delivery(session: Session) -> Counted:
    """Unix time of the oldest message in the outbox that has not arrived; empty if none waits."""
    waiting = Delivery.state.in_(("waiting", "sending"))
    earliest = session.scalar(select(func.min(Delivery.created_at)).where(waiting))
    return {} if earliest is None else {"": earliest.timestamp()}


def failed_deliveries(session: Session) -> Counted:
    """Number of messages that were given up, by code of the building."""
    deliveries = select(Receiver.building_id, COUNT).join(Delivery, Delivery.receiver_id == Receiver.id)
    return _by_building(session, deliveries.where(Delivery.state == "failed"))


def _by_building(session: Session, rows: Question) -> Counted:
    """Number of rows by code of the building, 0 where there is none; `rows` are (number of the building, COUNT)."""
    counts = rows.group_by("building_id").subquery()
    number = func.coalesce(counts.c.count, 0)
    return _counted(session, select(Building.code, number).outerjoin(counts, counts.c.building_id == Building.id))


def _counted(session: Session, query: Question) -> Counted:
    return {label: float(number) for label, number in session.execute(query)}


def _times(session: Session, query: Question) -> Counted:
    return {label: time.timestamp() for label, time in session.execute(query) if time is not None}


GAUGES: dict[str, tuple[str, str | None, Callable[[Session], Counted]]] = {
    "menshin_process_lease_timestamp_seconds": (
        "Until when the lease of a poller, a worker and a notifier lasts, Unix time; that of a dead one has passed.",
        "process",
        leases,
    ),
    "menshin_worker_waits": (
        "1 while the worker waits for its Dask cluster, 0 while it can compute; absent without a worker.",
        None,
        waiting_workers,
    ),
    "menshin_events": ("Events by state.", "state", events_by_state),
    "menshin_jobs": ("Jobs by state.", "state", jobs_by_state),
    "menshin_oldest_waiting_job_timestamp_seconds": (
        "When the oldest waiting job was made, Unix time; absent while none waits.",
        None,
        oldest_waiting_job,
    ),
    "menshin_last_good_record_timestamp_seconds": (
        "End of the last record that could be read, Unix time; absent before the first.",
        "building",
        last_good_records,
    ),
    "menshin_source_failing_since_timestamp_seconds": (
        "Since when the source has been failing, Unix time; absent while it answers.",
        "building",
        failing_sources,
    ),
    "menshin_stream_last_packet_timestamp_seconds": (
        "When the last packet of the live stream came, Unix time; absent before the first.",
        "building",
        stream_packets,
    ),
    "menshin_stream_latency_seconds": (
        "How far the slowest channel of the live stream lies behind now, s; absent before the first connection.",
        "building",
        stream_latencies,
    ),
    "menshin_stream_gaps": ("Gaps in the channels of the live stream, filled ones too.", "building", stream_gaps),
    "menshin_stream_missing_seconds": (
        "What is still missing in the channels of the live stream, s, together.",
        "building",
        stream_missing,
    ),
    "menshin_stream_packets_refused": (
        "Packets of the live stream that could not be used.",
        "building",
        stream_refused,
    ),
    "menshin_verdict": (
        "The verdict on the building: 0 normal, 1 watch, 2 undecided, 3 no data, 4 inspect, 5 act.",
        "building",
        verdicts,
    ),
    "menshin_open_alerts": (
        "Alerts that are open: active, acknowledged, under review or on hold.",
        "building",
        open_alerts,
    ),
    "menshin_recordings_refused": ("Files of which nothing could be used.", "building", refused_recordings),
    "menshin_analyses": ("Analyses done, earlier ones of an event too.", "outcome", analyses_by_outcome),
    "menshin_deliveries": (
        "Messages on their way to one receiver each, by state.",
        "state",
        deliveries_by_state,
    ),
    "menshin_oldest_waiting_delivery_timestamp_seconds": (
        "When the oldest message that has not arrived was put into the outbox, Unix time; absent while none waits.",
        None,
        oldest_waiting_delivery,
    ),
    "menshin_failed_deliveries": ("Messages that were given up.", "building", failed_deliveries),
}
"""Meaning, label and query of every gauge. The age of a time is `time() - METRIC`: it grows between two scrapes."""


def exposition(sessions: sessionmaker[Session], durations: Collector | None = None) -> bytes:
    """Every gauge with its present value in Prometheus' text format, and the durations of requests where given.

    The state is read from the database at every scrape, so that all processes report the same. The client library
    writes a line through several objects, which takes a second for the lines of 10,000 buildings.
    """
    parts = []
    escaped = cache(lambda text: text.translate(ESCAPED))  # several gauges have the codes of the buildings
    with sessions() as session:
        for name, (meaning, label, query) in GAUGES.items():
            parts.append(f"# HELP {name} {meaning}\n# TYPE {name} gauge\n")
            before, after = (f'{name}{{{label}="', '"}') if label else (name, "")
            parts += [f"{before}{escaped(one)}{after} {value!r}\n" for one, value in query(session).items()]
    return "".join(parts).encode() + (b"" if durations is None else generate_latest(durations))


class Measured:
    """Middleware that measures the duration of requests by route, so that addresses make no new series."""

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self._app = app
        self._durations = Histogram(
            "menshin_http_request_duration_seconds",
            "Duration of requests, and their number, by route and status.",
            ("route", "status"),
            registry=registry,
            buckets=SECONDS,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on and measure its duration."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status, begun = 500, time.perf_counter()

        async def noting(message: Message) -> None:
            nonlocal status
            status = message.get("status", status)
            await send(message)

        try:
            await self._app(scope, receive, noting)
        finally:
            self._durations.labels(_route(scope), status).observe(time.perf_counter() - begun)


def _route(scope: Scope) -> str:
    """The route's path with its parameters' names, behind its router's prefix; `other` without a route."""
    path = getattr(scope.get("route"), "path", None)
    return "other" if path is None else scope["path"].rsplit("/", path.count("/"))[0] + path
