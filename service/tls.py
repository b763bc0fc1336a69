"""The certificates by which servers are trusted."""

import os
import ssl
from functools import cache
from typing import Literal

import httpx

Protocol = Literal["http", "smtp"]


def tls_context(protocol: Protocol = "http") -> ssl.SSLContext:
    """The context of all connections by a protocol.

    It is made once a process: loading the certificates took half of the processor time of a poll of a quiet source.
    Changed certificates are in use from the next start on. Each protocol has its own, because HTTP clients write the
    name of theirs into it (ALPN, RFC 7301), which a mail server may refuse.
    """
    return _loaded(protocol, os.environ.get("SSL_CERT_FILE"), os.environ.get("SSL_CERT_DIR"))


@cache
def _loaded(protocol: Protocol, file: str | None, folder: str | None) -> ssl.SSLContext:
    """A context for each value of its arguments. HTTPX itself reads the two variables of the environment."""
    return httpx.create_ssl_context()
