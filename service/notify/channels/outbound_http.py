"""Posting to outside addresses without reaching into our own network.

Whoever may add a recipient chooses an address that this service connects to: it could be a router, a database or a
cloud's metadata service (server-side request forgery; OWASP Server-Side Request Forgery Prevention Cheat Sheet). So a
name is resolved once, all its addresses are checked, and the connection goes to a checked address, with the name for
TLS: a later change of the name has no effect. Redirects and proxies are not followed, and the exchange is limited in
time and bytes.
"""

import base64
import socket
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from ssl import SSLContext
from time import monotonic
from urllib.parse import unquote

import httpcore
import httpx

from service.notify.channels import DeliveryResult, one_line
from service.tls import tls_context

MOST_BYTES = 64 * 1024
"""Largest answer, with its head."""
IPAddress = IPv4Address | IPv6Address

TRANSLATED = IPv6Network("64:ff9b::/96")
"""IPv4 behind a translator (RFC 6052): the last 32 bits are the IPv4 address."""
TUNNELS = tuple(IPv6Network(one) for one in ("::/96", "64:ff9b:1::/48", "2001::/32", "2002::/16"))
"""Networks whose addresses contain an IPv4 address that is reached elsewhere (RFC 4291, 8215, 4380, 3056)."""
SPECIAL = tuple(
    ip_network(one) for one in ("192.0.0.0/24", "192.88.99.0/24", "2001::/23", "3fff::/20", "5f00::/16", "100::/64")
)
"""IANA special-purpose networks (RFC 6890, 7526, 9637, 9602), some unknown to this Python version."""
CLOUD = frozenset({IPv4Address("168.63.129.16")})
"""Public addresses of a cloud's own services: Azure's metadata and wire server."""


class NotAllowedError(OSError):
    """No message may be sent to this address."""


@dataclass(frozen=True, slots=True)
class Reach:
    """Addresses that may be reached beside public ones."""

    allowed: tuple[str, ...] = ()
    """Names of hosts, and networks."""
    plain_http: bool = False


class TooMuchError(Exception):
    """The answer is too long."""


def posted(url: str, headers: Mapping[str, str], body: bytes, reach: Reach, seconds: float) -> DeliveryResult:
    """Post bytes to an address outside.

    Args:
        url: https, or http where `reach` allows it.
        headers: without Host and Content-Length.
        body: sent unchanged.
        reach: addresses that may be reached.
        seconds: limit of the whole exchange.

    Returns:
        `delivered` for a status of 2xx; `not_taken` if nothing was sent, or the answer was a redirect or 4xx;
        otherwise `unknown`. 410 Gone is final.
    """
    try:
        address = httpx.URL(url)
    except httpx.InvalidURL:  # whose message repeats the address
        return DeliveryResult("not_taken", "its address is not a web address", is_final=True)
    if address.scheme != "https" and not (address.scheme == "http" and reach.plain_http):
        return DeliveryResult(
            "not_taken", f"{address.scheme}:// is not allowed: notify.allow_plain_http allows http://"
        )
    try:
        return _exchanged(address, _head(address, headers, body), body, reach, seconds)
    except (httpcore.ConnectError, httpcore.ConnectTimeout, OSError) as error:
        return DeliveryResult("not_taken", one_line(str(error) or type(error).__name__))
    except (httpcore.TimeoutException, httpcore.NetworkError, httpcore.ProtocolError, TooMuchError) as error:
        return DeliveryResult("unknown", one_line(f"no valid answer: {error or type(error).__name__}"))


def _head(address: httpx.URL, headers: Mapping[str, str], body: bytes) -> list[tuple[bytes, bytes]]:
    own = {"Host": address.netloc.decode(), "Content-Length": str(len(body)), "Connection": "close"}
    if address.userinfo:
        credentials = base64.b64encode(unquote(address.userinfo.decode()).encode()).decode()
        own["Authorization"] = f"Basic {credentials}"
    return [(name.encode("ascii"), value.encode("latin-1")) for name, value in (own | dict(headers)).items()]


def _exchanged(
    address: httpx.URL, head: list[tuple[bytes, bytes]], body: bytes, reach: Reach, seconds: float
) -> DeliveryResult:
    target = httpcore.URL(scheme=address.raw_scheme, host=address.raw_host, port=address.port, target=address.raw_path)
    guarded = Guarded(reach, monotonic() + seconds)
    timeouts = dict.fromkeys(("connect", "read", "write", "pool"), seconds)
    with httpcore.ConnectionPool(ssl_context=tls_context(), network_backend=guarded) as pool:
        response = pool.request("POST", target, headers=head, content=body, extensions={"timeout": timeouts})
    answer = one_line(f"{response.status} {response.content[:1000].decode('utf-8', 'replace')}")
    if 200 <= response.status < 300:
        return DeliveryResult("delivered", answer)
    return DeliveryResult("not_taken" if response.status < 500 else "unknown", answer, is_final=response.status == 410)


@dataclass(slots=True)
class Guarded(httpcore.NetworkBackend):
    """Connects to checked addresses only, until its time is over."""

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
        """A connection to the first address of the host that answers, provided that all of them may be reached."""
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
    """A connection limited in time and bytes."""

    stream: httpcore.NetworkStream
    end: float
    read_bytes: int = 0

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        """Read bytes.

        Raises:
            httpcore.ReadTimeout: the time is over.
            TooMuchError: the answer is too long.
        """
        data = self.stream.read(max_bytes, _left(self.end))
        self.read_bytes += len(data)
        if self.read_bytes > MOST_BYTES:
            raise TooMuchError(f"more than {MOST_BYTES} bytes")
        return data

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        """Send bytes.

        Raises:
            httpcore.WriteTimeout: the time is over.
        """
        self.stream.write(buffer, _left(self.end))

    def close(self) -> None:
        """Close the connection."""
        self.stream.close()

    def start_tls(
        self, ssl_context: SSLContext, server_hostname: str | None = None, timeout: float | None = None
    ) -> httpcore.NetworkStream:
        """The same, encrypted; the certificate is checked for the name, whatever the address."""
        self.stream = self.stream.start_tls(ssl_context, server_hostname, _left(self.end))
        return self

    def get_extra_info(self, info: str) -> object:
        """Details of the connection."""
        return self.stream.get_extra_info(info)


def _left(end: float) -> float:
    """Remaining seconds, at least a moment, so that a waiting call times out by itself."""
    return max(end - monotonic(), 1e-3)


def checked(host: str, port: int, reach: Reach) -> Sequence[str]:
    """The addresses of a host, after checking that all of them may be reached.

    Args:
        host: a name, or an address in any notation.
        port: of the connection.
        reach: addresses that may be reached.

    Raises:
        NotAllowedError: one of its addresses may not be reached.
        OSError: it has no address.
    """
    resolved = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    addresses = list(dict.fromkeys(str(one[4][0]) for one in resolved))
    if host.lower().rstrip(".") not in {name.lower() for name in reach.allowed}:
        for address in addresses:
            if not may_be_reached(address, reach):
                raise NotAllowedError(
                    f"{host} is {address}, which is not public; notify.allowed_private_hosts can allow it"
                )
    return addresses


def may_be_reached(address: str, reach: Reach) -> bool:
    """True if an address is public, or allowed although it is not."""
    target = _target(ip_address(address.partition("%")[0]))
    return _is_public(target) or any(target in network for network in _networks(reach))


def _target(address: IPAddress) -> IPAddress:
    """The address that is finally reached."""
    if isinstance(address, IPv6Address):
        if address.ipv4_mapped is not None:
            return address.ipv4_mapped
        if address in TRANSLATED:
            return IPv4Address(int(address) & 0xFFFFFFFF)
    return address


def _is_public(address: IPAddress) -> bool:
    if isinstance(address, IPv6Address) and (address.is_site_local or any(address in tunnel for tunnel in TUNNELS)):
        return False
    if any(address in network for network in SPECIAL if network.version == address.version):
        return False
    return address.is_global and not (address.is_multicast or address.is_reserved or address in CLOUD)


def _networks(reach: Reach) -> Sequence[IPv4Network | IPv6Network]:
    networks = []
    for one in reach.allowed:
        try:
            networks.append(ip_network(one, strict=False))
        except ValueError:  # a name
            continue
    return networks
