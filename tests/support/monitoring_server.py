"""A monitoring server on loopback that misbehaves on demand, and records for it to serve."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from email.utils import format_datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO

import numpy as np
from obspy import Stream, Trace, UTCDateTime

from service.records.sources.source import Known

BUILDING = """
code = "TOWER"
name = "A tower"
[[level]]
name = "ground"
role = "ground"
[[level]]
name = "base"
role = "base"
mass = 1e5
[[level]]
name = "roof"
mass = 1e5
[source]
kind = "{kind}"
location = "{location}"
{more}
[[channel]]
id = "XX.TOWER.00.HNX"
level = "ground"
direction = "x"
quantity = "acceleration"
{gain}
[[channel]]
id = "XX.TOWER.01.HNX"
level = "base"
direction = "x"
quantity = "acceleration"
{gain}
[[channel]]
id = "XX.TOWER.02.HNX"
level = "roof"
direction = "x"
quantity = "acceleration"
{gain}
"""
LOCATIONS = ("00", "01", "02")
VALIDATORS = {"ETag": "If-None-Match", "Last-Modified": "If-Modified-Since"}
START = datetime(2024, 1, 1, tzinfo=UTC)
GAIN = 1e-6
RATE = 100.0


def building_file(kind: str = "folder", location: str = ".", more: str = "", gain: str = f"gain = {GAIN}") -> str:
    """A building of three levels with an accelerometer each."""
    return BUILDING.format(kind=kind, location=location, more=more, gain=gain)


def stream(
    start: datetime = START, seconds: float = 20, locations: tuple[str, ...] = LOCATIONS, seed: int = 1
) -> Stream:
    """Noise of about 0.1 m/s² in counts."""
    rng = np.random.default_rng(seed)
    count = round(seconds * RATE)
    return Stream(
        Trace(
            np.round(1e5 * rng.standard_normal(count)).astype(np.int32),
            {
                "network": "XX",
                "station": "TOWER",
                "location": location,
                "channel": "HNX",
                "starttime": UTCDateTime(start),
                "sampling_rate": RATE,
            },
        )
        for location in locations
    )


def miniseed(traces: Stream) -> bytes:
    """As a logger writes it."""
    file = BytesIO()
    traces.write(file, format="MSEED", reclen=512)
    return file.getvalue()


@dataclass
class Page:
    """A response of the server."""

    body: bytes = b""
    status: int = 200
    headers: dict[str, str] = field(default_factory=dict)
    failures: int = 0
    """Times that it answers 500 first."""
    breaks_after: int | None = None
    """Bytes after which an answer breaks off."""
    breaks: int = 1
    """Answers that break off."""
    stalls: bool = False
    """True if it stops after the first byte."""
    promised: int | None = None
    """Content-Length, where it is not the body's."""
    says_length: bool = True
    """True if it states where its body ends."""


@dataclass
class Server:
    """The pages by path, and the requests."""

    address: str = ""
    pages: dict[str, Page] = field(default_factory=dict)
    requested: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    """Path with query, and headers."""
    ended: threading.Event = field(default_factory=threading.Event)
    waveforms: Stream | None = None
    """Answers dataselect, where it is given."""
    is_fdsn: bool = True
    """True if it states the version of its dataselect, as every FDSN server does."""
    most: int = 10**12
    """Samples beyond which dataselect answers 413."""

    def add(self, path: str, body: bytes, changed: datetime = START) -> Page:
        """A file."""
        self.pages[path] = Page(body, headers={"Last-Modified": format_datetime(changed, usegmt=True)})
        return self.pages[path]


@dataclass
class SourceMemory:
    """A source's memory, without a database."""

    files: dict[str, Known] = field(default_factory=dict)

    def known(self, addresses: Sequence[str]) -> dict[str, Known]:
        return {address: replace(self.files[address], beginning=None) for address in addresses if address in self.files}

    def beginning(self, address: str) -> bytes:
        return self.files[address].beginning or b""

    def keep(self, files: Sequence[Known]) -> None:
        self.files |= {file.address: file for file in files}


class QuietServer(ThreadingHTTPServer):
    """Says nothing of clients that go away in the middle: the tests make them."""

    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        """Silence."""


@contextmanager
def monitoring_server() -> Iterator[Server]:
    """A server on a free port of loopback."""
    server = Server()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            send_page(self, server)

        def log_message(self, format: str, *values: object) -> None:
            """No output: requests are kept in `requested`."""

    http = QuietServer(("127.0.0.1", 0), Handler)
    server.address = f"http://127.0.0.1:{http.server_port}"
    thread = threading.Thread(target=http.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield server
    finally:
        server.ended.set()
        http.shutdown()
        thread.join()
        http.server_close()


def send_page(request: BaseHTTPRequestHandler, server: Server) -> None:
    """Answer as the page says."""
    server.requested.append((request.path, dict(request.headers)))
    path, _, query = request.path.partition("?")
    if path not in server.pages and path == "/fdsnws/dataselect/1/query" and server.waveforms is not None:
        page = waveforms_between(server, query)
    elif path not in server.pages and path == "/fdsnws/dataselect/1/version" and server.is_fdsn:
        page = Page(b"1.1.3")
    else:
        page = server.pages.get(path, Page(status=404))
    if page.failures > 0:
        page.failures -= 1
        page = Page(b"it went wrong", 500)
    body, status, headers = page.body, page.status, dict(page.headers)
    had = {name: request.headers.get(requested) for name, requested in VALIDATORS.items()}
    if any(value is not None and value == headers.get(name) for name, value in had.items()):
        body, status = b"", 304
    requested = request.headers.get("Range", "")
    if requested and request.headers.get("If-Range") == headers.get("Last-Modified"):
        first = int(requested.removeprefix("bytes=").removesuffix("-"))
        headers["Content-Range"] = f"bytes {first}-{len(body) - 1}/{len(body)}"
        body, status = body[first:], 206
    request.send_response(status)
    if not page.says_length:
        request.close_connection = True
    elif status not in (204, 304):
        request.send_header("Content-Length", str(len(body) if page.promised is None else page.promised))
    for name, value in headers.items():
        request.send_header(name, value)
    request.end_headers()
    send_body(request, page, body, server)


def send_body(request: BaseHTTPRequestHandler, page: Page, body: bytes, server: Server) -> None:
    """Write the body, or the part that the page allows."""
    try:
        if page.stalls:
            request.wfile.write(body[:1])
            request.wfile.flush()
            server.ended.wait(60)
        elif page.breaks_after is not None and page.breaks > 0:
            request.wfile.write(body[: page.breaks_after])
            request.wfile.flush()
            page.breaks -= 1
            request.close_connection = True
        else:
            request.wfile.write(body)
    except OSError:  # the client has gone
        request.close_connection = True


def waveforms_between(server: Server, query: str) -> Page:
    """Waveforms between two times; 204 if there are none, 413 if they are too many."""
    given = dict(pair.split("=", 1) for pair in query.replace("%3A", ":").split("&"))
    assert server.waveforms is not None
    found = server.waveforms.slice(UTCDateTime(given["starttime"]), UTCDateTime(given["endtime"]))
    locations = given["location"].replace("%2C", ",").split(",")
    found = Stream(trace for trace in found if trace.stats.location in locations)
    if sum(trace.stats.npts for trace in found) > server.most:
        return Page(b"too much", 413)
    return Page(miniseed(found)) if found else Page(status=204)
