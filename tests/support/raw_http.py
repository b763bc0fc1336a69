"""Raw HTTP that no proper client would send."""

import re
import socket
from urllib.parse import urlsplit


def connect(address: str) -> socket.socket:
    """A connection to a server of ours."""
    parts = urlsplit(address)
    assert parts.hostname == "127.0.0.1"
    return socket.create_connection((parts.hostname, parts.port or 80), timeout=30)


def request_head(method: str, path: str, **headers: str | int) -> bytes:
    """The head of a request; underscores in names of headers become hyphens."""
    lines = [f"{method} {path} HTTP/1.1", "Host: 127.0.0.1"]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode()


def read_response(connection: socket.socket) -> bytes:
    """An answer, whole."""
    found, wanted = b"", 0
    while (b"\r\n\r\n" not in found or len(found) < wanted) and (piece := connection.recv(65536)):
        found += piece
        before, _, _ = found.partition(b"\r\n\r\n")
        length = re.search(rb"content-length: (\d+)", before, re.IGNORECASE)
        wanted = len(before) + 4 + (int(length[1]) if length else 0)
    return found


def response_status(connection: socket.socket) -> int:
    """An answer's status, 0 where the connection was closed without one."""
    try:
        found = read_response(connection)
    except ConnectionError:
        return 0
    return int(found.split()[1]) if found else 0


def bytes_accepted(connection: socket.socket, most: int, piece: bytes = b"x" * 65536) -> int:
    """Bytes that could be sent before the other side closed."""
    sent = 0
    try:
        while sent < most:
            connection.sendall(piece)
            sent += len(piece)
    except (ConnectionError, TimeoutError):
        pass
    return sent
