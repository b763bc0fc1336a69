"""Validation of monitoring servers' addresses."""

import re
from urllib.parse import urlsplit

ALLOWED = "http://host/path and https://host/path are allowed"


def wrong_web_address(address: str) -> str | None:
    """The problem with the address of a monitoring server; None if it is valid.

    The message repeats nothing that may be a secret.
    """
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        reason = "its port is not a number from 1 to 65535" if "ort" in str(error) else "its host cannot be read"
        return f"this is not a web address: {reason}; {ALLOWED}"
    if parts.scheme not in ("http", "https"):
        found = (
            f"it begins with {parts.scheme + ':'!r}" if parts.scheme else "it does not begin with http:// or https://"
        )
        return f"this is not a web address: {found}; {ALLOWED}"
    if not host:
        return f"this is not a web address: it names no host; {ALLOWED}"
    if not _is_host(host):
        return f"this is not a web address: {host!r} is not the name of a host; {ALLOWED}"
    if port == 0:
        return f"this is not a web address: no server listens at port 0; {ALLOWED}"
    if not address.isprintable() or " " in address:
        return f"this is not a web address: it has a space or a control character in it; {ALLOWED}"
    return None


def _is_host(host: str) -> bool:
    """A name of labels (RFC 1123; _ and other scripts are used too), or an address of IPv4 or IPv6."""
    if ":" in host:
        return True  # urlsplit has checked what stands in brackets
    labels = host.removesuffix(".").split(".")
    return len(host) < 254 and all(re.fullmatch(r"(?!-)[\w-]{1,63}(?<!-)", label) for label in labels)
