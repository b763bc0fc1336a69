"""The certificates by which servers are trusted."""

import os
import ssl
from functools import cache

import httpx


def tls_context() -> ssl.SSLContext:
    """The context of every connection to a server: one for the process and for each setting of SSL_CERT_FILE and _DIR.

    Loading the certificates took half of the processor time of a poll of a quiet source. Changed certificates are in
    use from the next start on. Nobody may change the context.
    """
    return _loaded(os.environ.get("SSL_CERT_FILE"), os.environ.get("SSL_CERT_DIR"))


@cache
def _loaded(file: str | None, folder: str | None) -> ssl.SSLContext:
    return httpx.create_ssl_context()
