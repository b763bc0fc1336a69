"""What is measured of the service for Prometheus: its requests as they come, and its state as the database has it."""

import time
from collections.abc import Callable, Iterator

from prometheus_client import CollectorRegistry, Histogram
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector
from sqlalchemy.orm import Session, sessionmaker
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.health.api import tallies
from service.health.api.tallies import Counted

SECONDS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
GAUGES: dict[str, tuple[str, str | None, Callable[[Session], Counted]]] = {
    "menshin_events": ("Events by state.", "state", tallies.events_by_state),
    "menshin_jobs": ("Jobs by state.", "state", tallies.jobs_by_state),
    "menshin_oldest_waiting_job_timestamp_seconds": (
        "When the oldest waiting job was made, Unix time; absent while none waits.",
        None,
        tallies.oldest_waiting_job,
    ),
    "menshin_last_good_record_timestamp_seconds": (
        "End of the last record that could be read, Unix time; absent before the first.",
        "building",
        tallies.last_good_records,
    ),
    "menshin_source_failing_since_timestamp_seconds": (
        "Since when the source has been failing, Unix time; absent while it answers.",
        "building",
        tallies.failing_sources,
    ),
    "menshin_verdict": (
        "The verdict on the building: 0 normal, 1 watch, 2 undecided, 3 no data, 4 inspect, 5 act.",
        "building",
        tallies.verdicts,
    ),
    "menshin_open_alerts": (
        "Alerts that are open: active, acknowledged, under review or on hold.",
        "building",
        tallies.open_alerts,
    ),
    "menshin_recordings_refused": ("Files of which nothing could be used.", "building", tallies.refused_recordings),
    "menshin_analyses": ("Analyses done, earlier ones of an event too.", "outcome", tallies.analyses_by_outcome),
    "menshin_deliveries": (
        "Messages on their way to one receiver each, by state.",
        "state",
        tallies.deliveries_by_state,
    ),
    "menshin_oldest_waiting_delivery_timestamp_seconds": (
        "When the oldest message that has not arrived was put into the outbox, Unix time; absent while none waits.",
        None,
        tallies.oldest_waiting_delivery,
    ),
    "menshin_failed_deliveries": ("Messages that were given up.", "building", tallies.failed_deliveries),
}
"""Meaning, label and question of every gauge. The age of a time is `time() - METRIC`: it grows between two scrapes."""


class Stored(Collector):
    """The state of the service, asked of the database at every scrape, so that all its processes tell the same."""

    def __init__(self, sessions: sessionmaker[Session]) -> None:
        self._sessions = sessions

    def describe(self) -> Iterator[GaugeMetricFamily]:
        """What there will be, without asking the database."""
        for name, (meaning, label, _) in GAUGES.items():
            yield GaugeMetricFamily(name, meaning, labels=[label] if label else [])

    def collect(self) -> Iterator[GaugeMetricFamily]:
        """Every gauge as it stands."""
        with self._sessions() as session:
            for family, (_, _, question) in zip(self.describe(), GAUGES.values(), strict=True):
                for label, value in question(session).items():
                    family.add_metric([label] if label else [], value)
                yield family


class Measured:
    """The application with the duration of every request taken by route, so that addresses make no new series."""

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
        """Pass the request on and take its duration."""
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
    """The route's path with its parameters' names, behind its router's prefix; what no route answers is all one."""
    path = getattr(scope.get("route"), "path", None)
    return "other" if path is None else scope["path"].rsplit("/", path.count("/"))[0] + path


def registry(sessions: sessionmaker[Session]) -> CollectorRegistry:
    """Everything that an application tells of itself, with sessions that only read."""
    made = CollectorRegistry()
    made.register(Stored(sessions))
    return made
