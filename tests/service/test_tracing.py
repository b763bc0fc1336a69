"""Traces reach a real receiver by OTLP: polls, jobs, deliveries, requests, what is within; none has a secret."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from cached_executor import CachedExecutor
from monitoring_server import Page, monitoring_server
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.proto.trace.v1.trace_pb2 import Span

from service import tracing
from service.settings import Settings

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]
PROGRAM = Path(__file__).parents[1] / "support" / "traced_service.py"


@contextmanager
def receiver() -> Iterator[tuple[str, list[bytes]]]:
    """Address of a receiver of traces (OTLP/HTTP), and the bodies that it received at /v1/traces."""
    bodies: list[bytes] = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            if self.path == "/v1/traces" and self.headers["Content-Type"] == "application/x-protobuf":
                bodies.append(body)
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", bodies
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def attributes(span: Span) -> dict[str, str | int]:
    return {one.key: one.value.string_value or one.value.int_value for one in span.attributes}


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Span], bytes]:
    """Spans sent by a process that polls, analyses, delivers and answers."""
    import databases

    folder = tmp_path_factory.mktemp("traced")
    with receiver() as (address, bodies), monitoring_server() as server:
        server.pages["/s3cret/"] = Page(b"<html></html>")
        source = server.address.replace("http://", "http://me:s3cret@") + "/s3cret/"
        given = [address, databases.sqlite(folder), folder, CachedExecutor.folder, source]
        program = [sys.executable, str(PROGRAM), *map(str, given)]
        done = subprocess.run(program, capture_output=True, text=True, cwd=PROGRAM.parent)
        assert done.returncode == 0, done.stderr[-3000:]
    spans = []
    for body in bodies:
        request = ExportTraceServiceRequest.FromString(body)
        for resource in request.resource_spans:
            assert {"menshin", "test"} <= {one.value.string_value for one in resource.resource.attributes}
            spans += [span for scope in resource.scope_spans for span in scope.spans]
    return spans, b"".join(bodies)


def only(spans: list[Span], name: str, **subject: str | int) -> Span:
    found = [
        one
        for one in spans
        if one.name == name and subject.items() <= {k.split(".")[-1]: v for k, v in attributes(one).items()}.items()
    ]
    assert len(found) == 1, [one.name for one in spans]
    return found[0]


def parts(spans: list[Span], whole: Span) -> list[Span]:
    return [one for one in spans if one.parent_span_id == whole.span_id]


def test_a_poll_and_an_analysis_are_traced_with_their_parts(traced: tuple[list[Span], bytes]) -> None:
    spans, _ = traced
    poll = only(spans, "poll", building="PAPER")
    assert {one.name.split()[0] for one in parts(spans, poll)} >= {"SELECT", "INSERT"}
    job = only(spans, "job", kind="analyse", event=1)
    assert not job.parent_span_id
    inner = parts(spans, job)
    stages = [one for one in inner if one.kind == Span.SPAN_KIND_INTERNAL]
    assert stages, "the stages of the analysis"
    assert all(job.start_time_unix_nano <= one.start_time_unix_nano <= one.end_time_unix_nano for one in stages)
    assert all(one.end_time_unix_nano <= job.end_time_unix_nano for one in inner)
    assert any(one.name.startswith("INSERT") for one in inner), "its result is stored within"


def test_a_delivery_is_traced_with_its_recipient_and_its_parts(traced: tuple[list[Span], bytes]) -> None:
    spans, _ = traced
    delivery = only(spans, "delivery", delivery=1)
    assert not delivery.parent_span_id
    assert attributes(delivery) == {"menshin.delivery": 1, "menshin.recipient": "PAPER/program"}
    inner = parts(spans, delivery)
    [sent] = [one for one in inner if one.name == "send"]
    assert attributes(sent) == {"menshin.recipient_kind": "webhook"}
    read = [one for one in inner if one.name.startswith("SELECT")]
    stored = [one for one in inner if one.name.startswith("UPDATE")]
    assert read
    assert stored
    assert max(one.end_time_unix_nano for one in read) <= sent.start_time_unix_nano <= sent.end_time_unix_nano
    assert all(sent.end_time_unix_nano <= one.start_time_unix_nano for one in stored), "the result"
    assert all(one.end_time_unix_nano <= delivery.end_time_unix_nano for one in inner)


def test_requests_are_traced_but_not_those_with_tokens(traced: tuple[list[Span], bytes]) -> None:
    spans, _ = traced
    served = [one for one in spans if one.kind == Span.SPAN_KIND_SERVER]
    assert [one.name for one in served] == ["GET /api/v1/buildings/{code}"]
    assert any(one.name.startswith("SELECT") for one in parts(spans, served[0]))


def test_no_trace_begins_with_a_statement_and_none_holds_a_secret(traced: tuple[list[Span], bytes]) -> None:
    spans, sent = traced
    roots = {one.name for one in spans if not one.parent_span_id}
    assert roots == {"poll", "job", "delivery", "GET /api/v1/buildings/{code}"}
    assert b"s3cret" not in sent
    poll = only(spans, "poll", building="TOWER")
    [asked] = [one for one in parts(spans, poll) if one.name == "GET"]
    address = next(value for name, value in attributes(asked).items() if name in ("http.url", "url.full"))
    assert str(address).startswith("http://127.0.0.1:")
    assert str(address).count("/") == 2, "without its path"


def test_without_the_packages_the_setting_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)
    monkeypatch.setattr(tracing, "_begun", [])
    with pytest.raises(tracing.NoTracesError, match=r"pip install 'menshin\[traces\]'"):
        tracing.begin("http://127.0.0.1:4318", 1.0, "test")


def test_an_address_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="this is not a web address"):
        Settings(traces={"endpoint": "localhost:4317"})
