"""A connection to a SeedLink server (3 and 4): packets as they come, without a wait that cannot be ended.

Protocol: International Federation of Digital Seismograph Networks, SeedLink 4.0 (2024); `seedlink-client` speaks it.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from queue import Empty, Full, Queue
from threading import Event as Signal, Thread
from typing import Any
from urllib.parse import unquote, urlsplit

from seedlink_client import Protocol, SeedLink, SeedLinkAuthError, SeedLinkError

from service.addresses import without_credentials
from service.records.sources.source import SourceError
from service.version import VERSION

PORTS = {"seedlink": 18000, "seedlinks": 18500}
"""By the scheme of the address; the second is encrypted."""
LARGEST = 2**16
"""Bytes of the largest packet that is accepted; usual ones have 512 to 4096."""
WAITING = 1000
"""Packets that may wait for the database; the server keeps further ones until there is room."""
KEEPALIVE = 20.0
"""s between two questions whether the server still answers, so that networks do not forget the connection."""
LAST_V3 = 0xFFFFFF
"""Largest sequence number of SeedLink 3; 0 follows."""
POLL = 0.2
"""s between two looks whether the connection is still wanted, while there is no room for a packet."""

Position = Mapping[str, Any]
"""`address`, `protocol`, and `stations`: the last sequence number by station."""


@dataclass(frozen=True, slots=True)
class Received:
    """One packet as the server sent it."""

    station: str
    """Network and station code, such as XX_TOWER."""
    sequence: int | None
    """None if the server gave none."""
    data: bytes = field(repr=False)


@dataclass(frozen=True, slots=True)
class Server:
    """A server that has answered."""

    address: str
    """Without name and password."""
    protocol: str
    """Version of SeedLink that it speaks: 3 or 4."""
    stations: frozenset[str]
    """Stations that were requested from it."""


class Connection:
    """A connection to a server, read by a thread of its own."""

    def __init__(self, address: str, channels: Sequence[str], position: Position, timeout: float) -> None:
        """Connect and request the channels from the position on.

        Args:
            address: such as seedlink://host:18000; seedlinks:// is encrypted.
            channels: ids.
            position: where an earlier connection ended; empty at first.
            timeout: s without a byte within an answer or a packet after which the connection is given up.
        """
        self.address = without_credentials(address)
        self.server: Server | None = None
        """None until it has answered."""
        self._selectors, self._position = _selectors(channels), position
        self._client = _client(address, timeout)
        self._packets: Queue[Received] = Queue(WAITING)
        self._ended = Signal()
        self._problem: str | None = None
        self._thread = Thread(target=self._read, name=f"stream {self.address}", daemon=True)
        self._thread.start()

    def packets(self, wait: float) -> list[Received]:
        """The packets that have come, at least one unless none comes within `wait` seconds.

        Raises:
            SourceError: the connection has ended, and all of its packets were returned.
        """
        came: list[Received] = []
        with suppress(Empty):
            came.append(self._packets.get(timeout=wait))
            while len(came) < WAITING:
                came.append(self._packets.get_nowait())
        if not came and self._ended.is_set() and self._packets.empty():
            problem = self._problem or "the server ended the connection"
            raise SourceError(f"the stream from {self.address} ended: {problem}")
        return came

    def close(self) -> None:
        """End the connection; its thread ends at its next step and is not waited for."""
        self._ended.set()
        with suppress(Exception):  # its thread may close it at the same moment
            self._client.close()

    def _read(self) -> None:
        try:
            self._client.connect()
            protocol = "4" if self._client.protocol is Protocol.V4 else "3"
            self._request(protocol)
            self.server = Server(self.address, protocol, frozenset(self._selectors))
            for packet in self._client.collect(reconnect=False):
                if len(packet.payload) > LARGEST:
                    raise SeedLinkError(f"a packet has {len(packet.payload)} bytes, {LARGEST} are accepted")
                if not self._put(Received(packet.station_id, packet.seqnum, packet.payload)):
                    return
        except SeedLinkAuthError:
            self._problem = "the server refuses the name and password in location of the building file"
        except SeedLinkError as error:
            self._problem = _said(error)
        except Exception as error:  # what a hostile answer makes the client stumble over, or its socket was closed
            self._problem = f"the server's answer cannot be understood ({type(error).__name__}: {error})"
        finally:
            self._ended.set()
            with suppress(Exception):
                self._client.close()

    def _put(self, packet: Received) -> bool:
        while not self._ended.is_set():
            with suppress(Full):
                self._packets.put(packet, timeout=POLL)
                return True
        return False

    def _request(self, protocol: str) -> None:
        is_same = (self._position.get("address"), self._position.get("protocol")) == (self.address, protocol)
        last: Mapping[str, int] = self._position.get("stations", {}) if is_same else {}
        for station, selectors in self._selectors.items():
            sequence = last.get(station)
            if protocol == "3" and sequence == LAST_V3:
                sequence = -1
            self._client.add_stream(station, selectors, seqnum=sequence)


def _client(address: str, timeout: float) -> SeedLink:
    parts = urlsplit(address)
    login = None if parts.username is None else (unquote(parts.username), unquote(parts.password or ""))
    return SeedLink(
        parts.hostname or "",
        parts.port or PORTS[parts.scheme],
        timeout=timeout,
        tls=parts.scheme == "seedlinks",
        keepalive=KEEPALIVE,
        idle_timeout=float("inf"),
        clientname="menshin",
        clientversion=VERSION,
        auth=login,
    )


def _selectors(channels: Sequence[str]) -> Mapping[str, list[str] | None]:
    """By station, its channels in the protocol's form; None where one has no such form, so that all are requested."""
    selectors: dict[str, list[str] | None] = {}
    for channel in channels:
        network, station, location, code = channel.split(".")
        had = selectors.setdefault(f"{network}_{station}", [])
        if len(code) != 3 or len(location) not in (0, 2):
            selectors[f"{network}_{station}"] = None
        elif had is not None:
            had.append(f"{location or '--'}{code}")
    return selectors


def _said(error: SeedLinkError) -> str:
    cause = f": {error.__cause__}" if error.__cause__ is not None and str(error.__cause__) not in str(error) else ""
    return " ".join(f"{error}{cause}".split())[:300]
