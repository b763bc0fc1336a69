"""Which addresses may messages be sent to?"""

import socket
from collections.abc import Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network

IPAddress = IPv4Address | IPv6Address

TRANSLATED = IPv6Network("64:ff9b::/96")
"""IPv4 behind a translator (RFC 6052): the last 32 bits are the address that is reached."""
TUNNELS = tuple(IPv6Network(one) for one in ("::/96", "64:ff9b:1::/48", "2001::/32", "2002::/16"))
"""Which hide an IPv4 address that is reached somewhere else (RFC 4291, 8215, 4380, 3056)."""
SPECIAL = tuple(
    ip_network(one) for one in ("192.0.0.0/24", "192.88.99.0/24", "2001::/23", "3fff::/20", "5f00::/16", "100::/64")
)
"""Of the IANA special-purpose address registries (RFC 6890, 7526, 9637, 9602), whatever this Python knows of them."""
CLOUD = frozenset({IPv4Address("168.63.129.16")})
"""Of a cloud's own services, although public: Azure's metadata and wire server."""


class NotAllowedError(OSError):
    """An address that no message may be sent to."""


@dataclass(frozen=True, slots=True)
class Reach:
    """What may be reached."""

    allowed: tuple[str, ...] = ()
    """Names of hosts, and networks, that may be reached although they are not public."""
    plain_http: bool = False


def checked(host: str, port: int, reach: Reach) -> Sequence[str]:
    """The addresses of a host, all of which may be reached.

    Args:
        host: a name, or an address however it is written.
        port: that is connected to.
        reach: what may be reached.

    Raises:
        NotAllowedError: one of its addresses must not be reached.
        OSError: it has none.
    """
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    addresses = list(dict.fromkeys(str(one[4][0]) for one in found))
    if host.lower().rstrip(".") not in {name.lower() for name in reach.allowed}:
        for address in addresses:
            if not may_be_reached(address, reach):
                raise NotAllowedError(
                    f"{host} is {address}, which is not public; notify.allowed_private_hosts can allow it"
                )
    return addresses


def may_be_reached(address: str, reach: Reach) -> bool:
    """Whether an address is public, or allowed although it is not."""
    found = _meant(ip_address(address.partition("%")[0]))
    return _is_public(found) or any(found in network for network in _networks(reach))


def _meant(address: IPAddress) -> IPAddress:
    """The address that is reached in the end."""
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
