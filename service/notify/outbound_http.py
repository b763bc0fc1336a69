"""How is an address of the outside asked, without reaching inside our own network by it?

Whoever may add a receiver chooses where this service connects to: to a router, a database or a cloud's metadata at
that (server-side request forgery; OWASP Server-Side Request Forgery Prevention Cheat Sheet). So the name is resolved
once, every address it has is checked, and the connection goes to one that was checked, under the name for TLS: what
the name resolves to a moment later does not matter. No redirect is followed and no proxy is asked, and the whole
exchange has an end in time and in bytes.
"""

import base64
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from ssl import SSLContext
from time import monotonic
from urllib.parse import unquote

import httpcore
import httpx

from service.notify.addresses import Reach, checked
from service.notify.outcome import Answer, one_line

MOST_BYTES = 64 * 1024
"""Of an answer, with its head."""


class TooMuchError(Exception):
    """An answer is longer than anything that a receiver has to say."""


def posted(url: str, headers: Mapping[str, str], body: bytes, reach: Reach, seconds: float) -> Answer:
    """Post bytes to an address outside.

    Args:
        url: https, or http where `reach` allows it.
        headers: but for Host and the body's length.
        body: sent as it is.
        reach: what may be connected to.
        seconds: that all of it may take.

    Returns:
        `delivered` for a status of 2xx; `not_taken` where nothing was sent, or the answer was a redirect or 4xx;
        else `unknown`. 410 Gone is final.
    """
    try:
        address = httpx.URL(url)
    except httpx.InvalidURL:  # whose message repeats the address
        return Answer("not_taken", "its address is no web address", is_final=True)
    if address.scheme != "https" and not (address.scheme == "http" and reach.plain_http):
        return Answer("not_taken", f"{address.scheme}:// is not allowed: notify.allow_plain_http allows http://")
    try:
        return _asked(address, _head(address, headers, body), body, reach, seconds)
    except (httpcore.ConnectError, httpcore.ConnectTimeout, OSError) as error:
        return Answer("not_taken", one_line(str(error) or type(error).__name__))
    except (httpcore.TimeoutException, httpcore.NetworkError, httpcore.ProtocolError, TooMuchError) as error:
        return Answer("unknown", one_line(f"no answer that is one: {error or type(error).__name__}"))


def _head(address: httpx.URL, headers: Mapping[str, str], body: bytes) -> list[tuple[bytes, bytes]]:
    own = {"Host": address.netloc.decode(), "Content-Length": str(len(body)), "Connection": "close"}
    if address.userinfo:
        credentials = base64.b64encode(unquote(address.userinfo.decode()).encode()).decode()
        own["Authorization"] = f"Basic {credentials}"
    return [(name.encode("ascii"), value.encode("latin-1")) for name, value in (own | dict(headers)).items()]


def _asked(address: httpx.URL, head: list[tuple[bytes, bytes]], body: bytes, reach: Reach, seconds: float) -> Answer:
    target = httpcore.URL(scheme=address.raw_scheme, host=address.raw_host, port=address.port, target=address.raw_path)
    guarded = Guarded(reach, monotonic() + seconds)
    patience = dict.fromkeys(("connect", "read", "write", "pool"), seconds)
    with httpcore.ConnectionPool(ssl_context=httpx.create_ssl_context(), network_backend=guarded) as pool:
        response = pool.request("POST", target, headers=head, content=body, extensions={"timeout": patience})
    said = one_line(f"{response.status} {response.content[:1000].decode('utf-8', 'replace')}")
    if 200 <= response.status < 300:
        return Answer("delivered", said)
    return Answer("not_taken" if response.status < 500 else "unknown", said, is_final=response.status == 410)


@dataclass(slots=True)
class Guarded(httpcore.NetworkBackend):
    """Connects to addresses that were checked only, until its time is over."""

    reach: Reach
    end: float
    """By time.monotonic."""

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[httpcore.SOCKET_OPTION] | None = None,
    ) -> httpcore.NetworkStream:
        """A connection to the first of the host's addresses that answers, if all of them may be reached."""
        last: Exception = httpcore.ConnectError(f"{host} has no address")
        for address in checked(host, port, self.reach):
            try:
                connected = httpcore.SyncBackend().connect_tcp(address, port, _left(self.end), local_address)
                return Bounded(connected, self.end)
            except (httpcore.ConnectError, httpcore.ConnectTimeout) as error:
                last = error
        raise last


@dataclass(slots=True)
class Bounded(httpcore.NetworkStream):
    """A connection that ends in time, and after so many bytes."""

    stream: httpcore.NetworkStream
    end: float
    read_bytes: int = 0

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        """What has come.

        Raises:
            httpcore.ReadTimeout: the time is over.
            TooMuchError: more has come than an answer may be long.
        """
        data = self.stream.read(max_bytes, _left(self.end))
        self.read_bytes += len(data)
        if self.read_bytes > MOST_BYTES:
            raise TooMuchError(f"more than {MOST_BYTES} bytes")
        return data

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        """Send.

        Raises:
            httpcore.WriteTimeout: the time is over.
        """
        self.stream.write(buffer, _left(self.end))

    def close(self) -> None:
        """End it."""
        self.stream.close()

    def start_tls(
        self, ssl_context: SSLContext, server_hostname: str | None = None, timeout: float | None = None
    ) -> httpcore.NetworkStream:
        """The same, but encrypted; the certificate is that of the name, whatever the address."""
        self.stream = self.stream.start_tls(ssl_context, server_hostname, _left(self.end))
        return self

    def get_extra_info(self, info: str) -> object:
        """What the connection knows of itself."""
        return self.stream.get_extra_info(info)


def _left(end: float) -> float:
    """Seconds that are left; a moment once there are none, so that what waits gives up by itself."""
    return max(end - monotonic(), 1e-3)
