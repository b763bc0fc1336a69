"""Traces by OpenTelemetry, if the settings name a receiver and the extra `traces` is installed; otherwise nothing.

Traced are polls of sources, jobs with their stages, deliveries with their sending, and requests to the API and the
pages; within these the statements to the database and, of polls, the requests to other servers. No span has the query
of an address, the path of another server's address, or a statement's parameters.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from service import logs
from service.version import VERSION

if TYPE_CHECKING:
    from fastapi import FastAPI

PATH = "/v1/traces"
"""Path at an OTLP receiver (OpenTelemetry Protocol 1.5, OTLP/HTTP)."""
UNTRACED = "healthz,readyz,metrics,static,login,link"
"""Beginnings of paths that are asked too often, or whose addresses hold tokens."""
ADDRESSES = ("url.full", "http.url", "http.target", "url.query", "url.path")
"""Attributes of spans that may hold secrets."""
_begun: list[Any] = []
"""The provider, once traces are sent."""


class NoTracesError(RuntimeError):
    """Traces are wanted, but the packages for them are not installed."""

    def __init__(self) -> None:
        super().__init__("traces.endpoint needs OpenTelemetry: pip install 'menshin[traces]'")


def begin(endpoint: str | None, share: float, process: str) -> None:
    """Send the traces of this process from now on; databases must be opened afterwards.

    Args:
        endpoint: address of an OTLP receiver; None: there are no traces.
        share: of the traces that are sent, 0 to 1.
        process: name of the process, for people.

    Raises:
        NoTracesError: the packages are missing.
    """
    if endpoint is None or _begun:
        return
    try:
        from opentelemetry import trace
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.instrumentation.httpx import HTTPXClientInstrumentor
        from opentelemetry.instrumentation.sqlalchemy import SQLAlchemyInstrumentor
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor

        from service.trace_sampling import Rooted
    except ModuleNotFoundError as error:
        raise NoTracesError from error
    resource = Resource.create({"service.name": "menshin", "service.version": VERSION, "process.name": process})
    provider = TracerProvider(resource=resource, sampler=Rooted(share))
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(endpoint=endpoint.rstrip("/") + PATH)))
    trace.set_tracer_provider(provider)
    HTTPXClientInstrumentor().instrument(request_hook=_hide_address, async_request_hook=_hide_address_later)
    SQLAlchemyInstrumentor().instrument(skip_dep_check=True)  # it says less than 2.1, and works with it: a test looks
    _begun.append(provider)


def end() -> None:
    """Send what has not been sent."""
    for provider in _begun:
        provider.force_flush()


def trace_requests(app: "FastAPI") -> None:
    """Trace the requests to an application."""
    if _begun:
        from opentelemetry.instrumentation.fastapi import FastAPIInstrumentor

        FastAPIInstrumentor.instrument_app(
            app, excluded_urls=UNTRACED, exclude_spans=["receive", "send"], server_request_hook=_hide_query
        )


def _hide_address(span: Any, request: Any) -> None:  # noqa: ANN401  OpenTelemetry's own types, which may be absent
    """Keep scheme, host and port: the paths of webhooks and watchdogs are secrets."""
    parts = urlsplit(str(request.url))
    _replace(span, f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}")


async def _hide_address_later(span: Any, request: Any) -> None:  # noqa: ANN401  as above
    _hide_address(span, request)


def _hide_query(span: Any, scope: dict[str, Any]) -> None:  # noqa: ANN401  as above
    _replace(span, scope.get("path", ""))


def _replace(span: Any, address: str) -> None:  # noqa: ANN401  as above
    for name in ADDRESSES:
        if name in (getattr(span, "attributes", None) or {}):
            span.set_attribute(name, "" if name == "url.query" else address)


@contextmanager
def span(name: str, **subject: object) -> Iterator[None]:
    """A span about this subject, and so the lines of the log within."""
    if not _begun:
        with logs.about(**subject):
            yield
        return
    from opentelemetry import trace

    tracer = trace.get_tracer("menshin")
    with (
        tracer.start_as_current_span(name, attributes=_attributes(subject)) as made,
        logs.about(**subject, trace=_identity(made)),
    ):
        yield


def _attributes(subject: dict[str, object]) -> dict[str, Any]:
    return {f"menshin.{name}": value for name, value in subject.items() if value is not None}


def _identity(made: Any) -> str:  # noqa: ANN401  as above
    return f"{made.get_span_context().trace_id:032x}"


@dataclass(slots=True)
class Work:
    """A span that begins in one call and ends in another, with stages one after the other."""

    _span: Any = None
    _stage: Any = None

    @classmethod
    def begun(cls, name: str, **subject: object) -> "Work":
        """A new one; without traces it does nothing."""
        if not _begun:
            return cls()
        from opentelemetry import trace

        return cls(trace.get_tracer("menshin").start_span(name, attributes=_attributes(subject)))

    def within(self) -> Any:  # noqa: ANN401  as above
        """A context in which spans are parts of this one, and lines of the log name its trace."""
        if self._span is None:
            return nullcontext()
        return self._in_trace()

    @contextmanager
    def _in_trace(self) -> Iterator[None]:
        from opentelemetry import trace

        with trace.use_span(self._span, end_on_exit=False), logs.about(trace=_identity(self._span)):
            yield

    def stage(self, name: str) -> None:
        """End the stage before, and begin one."""
        self.end_stage()
        if self._span is not None:
            from opentelemetry import trace

            self._stage = trace.get_tracer("menshin").start_span(name, context=trace.set_span_in_context(self._span))

    def end(self, problem: BaseException | None = None) -> None:
        """End it, with the problem that ended it; a second time it does nothing."""
        self.end_stage()
        if self._span is None:
            return
        if problem is not None:
            from opentelemetry.trace import Status, StatusCode

            self._span.set_status(Status(StatusCode.ERROR, type(problem).__name__))
        self._span.end(time.time_ns())
        self._span = None

    def end_stage(self) -> None:
        """End the stage, if one is under way."""
        if self._stage is not None:
            self._stage.end()
            self._stage = None
