"""Addresses of servers: validation, and a form without secrets for display."""

import ipaddress
import re
from urllib.parse import urlsplit

ALLOWED = "http://host/path and https://host/path are allowed"
STREAMS_ALLOWED = "seedlink://host:18000 and seedlinks://host:18500 (encrypted) are allowed"
ADDRESS = re.compile(r"[a-z][a-z0-9+.-]{0,19}://[^\s<>\"]+", re.IGNORECASE)
CLOSING = ".,;:!?'`)]}…"
"""Punctuation that follows an address in a sentence."""


def web_address_problem(address: str) -> str | None:
    """The problem with the address of a monitoring server; None if it is valid.

    The message repeats nothing that may be a secret.
    """
    problem = _problem(address, ("http", "https"))
    return None if problem is None else f"this is not a web address: {problem}; {ALLOWED}"


def stream_address_problem(address: str) -> str | None:
    """The problem with the address of a SeedLink server, without anything that may be a secret; None if it is valid."""
    problem = _problem(address, ("seedlink", "seedlinks"))
    if problem is None and urlsplit(address).path not in ("", "/"):
        problem = "it has a path"
    return None if problem is None else f"this is not the address of a live stream: {problem}; {STREAMS_ALLOWED}"


def _problem(address: str, schemes: tuple[str, str]) -> str | None:
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        return "its port is not a number from 1 to 65535" if "ort" in str(error) else "its host cannot be read"
    if parts.scheme not in schemes:
        beginnings = " or ".join(f"{scheme}://" for scheme in schemes)
        return f"it begins with {parts.scheme + ':'!r}" if parts.scheme else f"it does not begin with {beginnings}"
    if not host:
        return "it names no host"
    if not _is_host(host):
        return f"{host!r} is not the name of a host"
    if port == 0:
        return "no server listens at port 0"
    if not address.isprintable() or " " in address:
        return "it contains a space or a control character"
    return None


def is_loopback(host: str | None) -> bool:
    """True if a host, from an address or a Host header without its port, is this machine itself."""
    if host == "localhost":
        return True
    try:
        return host is not None and ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _is_host(host: str) -> bool:
    """True for a name of labels (RFC 1123, with _ and other scripts), or an address of IPv4 or IPv6."""
    if ":" in host:
        return True  # urlsplit has checked the address in brackets
    labels = host.removesuffix(".").split(".")
    return len(host) < 254 and all(re.fullmatch(r"(?!-)[\w-]{1,63}(?<!-)", label) for label in labels)


def without_credentials(text: str) -> str:
    """The text with every address in it reduced to scheme, host, port and path.

    User info, query and fragment may hold secrets and are removed. Other words and file paths are unchanged.
    """
    return ADDRESS.sub(_shown, text) if "://" in text else text


def _shown(match: re.Match[str]) -> str:
    scheme, _, rest = match[0].partition("://")
    kept = re.split(r"[?#]", rest, maxsplit=1)[0]
    address = f"{scheme}://{kept.rpartition('@')[2]}"  # a password may have a / in it
    return address if kept == rest else address + rest[len(rest.rstrip(CLOSING)) :]
