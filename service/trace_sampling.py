"""Which traces are sent. Only imported where OpenTelemetry is installed."""

from collections.abc import Sequence
from typing import Any

from opentelemetry.context import Context
from opentelemetry.sdk.trace.sampling import Decision, ParentBased, Sampler, SamplingResult, TraceIdRatioBased
from opentelemetry.trace import Link, SpanKind, TraceState
from opentelemetry.util.types import Attributes


class Rooted(Sampler):  # type: ignore[misc]  # OpenTelemetry is optional, its types are not followed
    """A share of the traces, but none that begins with a statement or a request to another server.

    Pollers, workers and notifiers look into the database several times a second: those statements are of no use alone.
    """

    def __init__(self, share: float) -> None:
        self._of_roots = TraceIdRatioBased(share)
        self._of_parts = ParentBased(self)

    def should_sample(
        self,
        parent_context: Context | None,
        trace_id: int,
        name: str,
        kind: SpanKind | None = None,
        attributes: Attributes = None,
        links: Sequence[Link] | None = None,
        trace_state: TraceState | None = None,
    ) -> SamplingResult:
        """Decision to send a span: as its parent's, or by the share of traces."""
        from opentelemetry.trace import get_current_span

        rest: tuple[Any, ...] = (trace_id, name, kind, attributes, links)
        parent = get_current_span(parent_context).get_span_context()
        if parent.is_valid:
            return self._of_parts.should_sample(parent_context, *rest)
        if kind is SpanKind.CLIENT:
            return SamplingResult(Decision.DROP)
        return self._of_roots.should_sample(parent_context, *rest)

    def get_description(self) -> str:
        """For people."""
        return f"Rooted({self._of_roots.get_description()})"
