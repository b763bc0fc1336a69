"""A SeedLink server (3 and 4) as a process of its own, which misbehaves on demand.

`python tests/support/seedlink_server.py [VERSIONS]` prints its port, then carries out the JSON lines of its standard
input, each with one line in answer, and ends with it. VERSIONS is `3`, `4` or `34`.

Protocol: FDSN, SeedLink 4.0 (2024); for version 3 the manual of libslink. Its answers are checked with two clients that
know nothing of this program, ObsPy's and seedlink-client.
"""

import json
import socket
import struct
import subprocess
import sys
import threading
from base64 import b64decode, b64encode
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

ABILITIES = ("dialup", "multistation", "info:id", "info:capabilities", "info:stations")
"""Abilities of version 3."""
INFO_RECORD = 512
"""Bytes of a record that carries an answer to INFO in version 3."""


@dataclass(frozen=True)
class Sent:
    """A packet in the server's buffer."""

    sequence: int
    data: bytes

    @property
    def codes(self) -> tuple[str, str, str, str]:
        """Network, station, location and channel, from the fixed header of miniSEED 2 (SEED manual 2.4, chapter 8)."""
        text = self.data[8:20].decode("latin-1")
        return text[10:12].strip(), text[0:5].strip(), text[5:7].strip(), text[7:10].strip()


@dataclass
class Wanted:
    """The request for one station."""

    network: str
    station: str
    selectors: list[str] = field(default_factory=list)
    first: int | None = None
    """Sequence number to begin with; None for the next packet to come."""

    def wants(self, packet: Sent) -> bool:
        """True for a packet of the station that a selector names."""
        network, station, location, channel = packet.codes
        if not (fnmatchcase(network, self.network) and fnmatchcase(station, self.station)):
            return False
        old, new = f"{location or '--'}{channel}", f"{location}_{'_'.join(channel)}"
        patterns = [one.split(".")[0] for one in self.selectors]
        return not patterns or any(fnmatchcase(old, one) or fnmatchcase(new, one) for one in patterns)


@dataclass
class Ring:
    """The packets of the server, and its faults."""

    versions: str
    packets: list[Sent] = field(default_factory=list)
    next: int = 1
    is_stalled: bool = False
    changed: threading.Condition = field(default_factory=threading.Condition)
    connections: set[socket.socket] = field(default_factory=set)
    requests: list[str] = field(default_factory=list)
    """Commands that came."""

    def carry_out(self, command: dict[str, Any]) -> int | list[str]:
        """Carry out a line of the standard input; returns the number of connections that stream, or the commands."""
        with self.changed:
            match command["do"]:
                case "add":
                    for data in command["data"]:
                        self.packets.append(Sent(self.next, b64decode(data)))
                        self.next += 1
                case "number":
                    self.next = command["next"]
                case "forget":
                    self.packets.clear()
                case "repeat":  # all that was sent comes again, to everybody
                    self.packets += list(self.packets)
                case "stall":
                    self.is_stalled = command["is"]
                case "raw":
                    for connection in self.connections:
                        with suppress(OSError):
                            connection.sendall(b64decode(command["data"]))
                case "drop":
                    for connection in self.connections:
                        with suppress(OSError):
                            connection.shutdown(socket.SHUT_RDWR)
                case "count":
                    pass
                case "requests":
                    return self.requests
            self.changed.notify_all()
        return len(self.connections)


class Client(threading.Thread):
    """One connection."""

    def __init__(self, ring: Ring, connection: socket.socket) -> None:
        super().__init__(daemon=True)
        self.ring, self.connection = ring, connection
        self.version = 3
        self.wanted: list[Wanted] = []
        self.is_streaming = False
        self.sending = threading.Lock()

    def run(self) -> None:
        """Answer commands until the connection ends."""
        with self.connection, suppress(OSError, ValueError):
            rest = b""
            while chunk := self.connection.recv(4096):
                rest = (rest + chunk).replace(b"\n", b"\r")
                *lines, rest = rest.split(b"\r")
                for line in filter(None, lines):
                    self.answer(line.decode("ascii").split())
        with self.ring.changed:
            self.ring.connections.discard(self.connection)
            self.ring.changed.notify_all()

    def send(self, data: bytes) -> None:
        """Send bytes of one packet or answer together."""
        with self.sending:
            self.connection.sendall(data)

    def answer(self, words: list[str]) -> None:
        """Answer one command."""
        command, *given = words
        with self.ring.changed:
            self.ring.requests.append(" ".join(words))
        ok = b"OK\r\n"
        match command.upper():
            case "HELLO":
                protocols = {"3": "SLPROTO:3.1", "4": "SLPROTO:4.0"}
                offered = " ".join(protocols[version] for version in self.ring.versions)
                name = "v3.3 (2024.001)" if "3" in self.ring.versions else "v4.0 (2024.001)"
                self.send(f"SeedLink {name} :: {offered}\r\nA test\r\n".encode())
            case "SLPROTO":
                self.version = 4
                self.send(ok)
            case "STATION" if self.version == 4:
                network, _, station = given[0].partition("_")
                self.wanted.append(Wanted(network, station))
                self.send(ok)
            case "STATION":
                self.wanted.append(Wanted(given[1], given[0]))
                self.send(ok)
            case "SELECT":
                self.wanted[-1].selectors += given
                self.send(ok)
            case "DATA" | "FETCH":
                if given and given[0] != "ALL":
                    self.wanted[-1].first = int(given[0], 10 if self.version == 4 else 16)
                elif given:
                    self.wanted[-1].first = 0
                self.send(ok)
            case "END":
                self.is_streaming = True
                threading.Thread(target=self.stream, daemon=True).start()
            case "INFO":
                self.inform(given[0])
            case "BYE":
                self.connection.shutdown(socket.SHUT_RDWR)
            case "USERAGENT" | "AUTH" if self.version == 4:
                self.send(ok)
            case _:
                self.send(b"ERROR UNSUPPORTED unknown command\r\n" if self.version == 4 else b"ERROR\r\n")

    def stream(self) -> None:
        """Send every packet that is wanted, once each, in the order of the buffer."""
        ring = self.ring
        with ring.changed:
            ring.connections.add(self.connection)
            ring.changed.notify_all()
            begun = {id(one): self.beginning(one.first) for one in self.wanted}
            at = min(begun.values())
        with suppress(OSError):
            while (packet := self.next_packet(at)) is not None:
                if any(one.wants(packet) and at >= begun[id(one)] for one in self.wanted):
                    self.send(self.framed(packet))
                at += 1

    def next_packet(self, at: int) -> Sent | None:
        """The packet at this index, once it is there; None when the connection has ended."""
        ring = self.ring
        with ring.changed:
            while self.connection in ring.connections:
                if at < len(ring.packets) and not ring.is_stalled:
                    return ring.packets[at]
                ring.changed.wait()
        return None

    def beginning(self, first: int | None) -> int:
        """Index of the first packet to send: the buffer's first with this number or a later one."""
        packets = self.ring.packets
        if first is None:
            return len(packets)
        if self.version == 3:  # numbers of six digits: behind the packet that has the number before
            before = (first - 1) % 2**24
            at = [index for index, one in enumerate(packets) if one.sequence % 2**24 == before]
            return at[-1] + 1 if at else 0
        at = [index for index, one in enumerate(packets) if one.sequence >= first]
        return at[0] if at else len(packets)

    def framed(self, packet: Sent) -> bytes:
        """A packet with its header."""
        if self.version == 3:
            return f"SL{packet.sequence % 2**24:06X}".encode() + packet.data
        station = "_".join(packet.codes[:2]).encode()
        return (
            struct.pack("<2sccIQB", b"SE", b"2", b"D", len(packet.data), packet.sequence, len(station))
            + station
            + packet.data
        )

    def inform(self, level: str) -> None:
        """Answer INFO: JSON in version 4, XML in miniSEED in version 3."""
        stations = sorted({packet.codes[:2] for packet in self.ring.packets})
        if self.version == 4:
            rows = [{"id": f"{network}_{station}"} for network, station in stations]
            text = json.dumps({"software": "test", "organization": "A test", "station": rows}).encode()
            self.send(struct.pack("<2sccIQB", b"SE", b"J", b"I", len(text), 2**64 - 1, 0) + text)
            return
        abilities = "".join(f'<capability name="{name}"/>' for name in ABILITIES)
        elements = "".join(f'<station name="{station}" network="{network}"/>' for network, station in stations)
        document = (
            f'<?xml version="1.0"?><seedlink software="test" organization="A test">{abilities}{elements}</seedlink>'
        )
        records = list(_text_records(document.encode()))
        for number, record in enumerate(records, start=1):
            self.send(b"SLINFO *" if number < len(records) else b"SLINFO  ")
            self.send(record)


def _text_records(text: bytes) -> Iterator[bytes]:
    """miniSEED records of characters."""
    from obspy import Stream, Trace

    samples = np.frombuffer(text, dtype="|S1")
    header = {"network": "XX", "station": "INFO", "channel": "INF", "sampling_rate": 0.0}
    file = BytesIO()
    Stream([Trace(samples, header)]).write(file, format="MSEED", reclen=INFO_RECORD, encoding="ASCII")
    data = file.getvalue()
    for at in range(0, len(data), INFO_RECORD):
        yield data[at : at + INFO_RECORD]


def main(versions: str) -> None:
    """Serve until the standard input ends."""
    ring = Ring(versions)
    with socket.create_server(("127.0.0.1", 0)) as door:
        _say(door.getsockname()[1])

        def accept() -> None:
            with suppress(OSError):
                while True:
                    Client(ring, door.accept()[0]).start()

        threading.Thread(target=accept, daemon=True).start()
        for line in sys.stdin:
            _say(ring.carry_out(json.loads(line)))


def _say(answer: int | list[str]) -> None:
    sys.stdout.write(f"{json.dumps(answer)}\n")
    sys.stdout.flush()


class SeedLinkServer:
    """The test's side of the process."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self.port = int(self._line())

    @property
    def address(self) -> str:
        """Its address, for a building file."""
        return f"seedlink://127.0.0.1:{self.port}"

    def add(self, data: bytes | Sequence[bytes], size: int = 512) -> None:
        """Add packets: records of one file, or given ones."""
        records = [data[at : at + size] for at in range(0, len(data), size)] if isinstance(data, bytes) else data
        self.do("add", data=[b64encode(record).decode() for record in records])

    def raw(self, data: bytes) -> None:
        """Send bytes to every client, as they are."""
        self.do("raw", data=b64encode(data).decode())

    def do(self, command: str, **given: int | list[str] | str) -> int:
        """Carry out a command; returns the number of connections that stream."""
        return int(self._answer({"do": command, **given}))

    def requests(self) -> list[str]:
        """The commands that came."""
        return list(self._answer({"do": "requests"}))

    def _answer(self, command: dict[str, object]) -> Any:  # noqa: ANN401  whatever the command answers
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(command) + "\n")
        self._process.stdin.flush()
        return json.loads(self._line())

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()


@contextmanager
def seedlink_server(versions: str = "34") -> Iterator[SeedLinkServer]:
    """A server that ends with the block."""
    with subprocess.Popen(
        [sys.executable, str(Path(__file__)), versions], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield SeedLinkServer(process)
        finally:
            process.kill()


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "34")
