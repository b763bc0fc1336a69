"""A server that misbehaves, and clients for it."""

import threading
from collections.abc import Iterator
from math import inf

import pytest
from monitoring_server import Server, monitoring_server

from service.records.sources.retried_requests import Client, Manners, client
from service.settings import Settings

SETTINGS = Settings(http_timeout=0.5, http_retries=2, retry_delay=0.01, max_answer_bytes=1_000_000)


@pytest.fixture
def server() -> Iterator[Server]:
    with monitoring_server() as server:
        yield server


@pytest.fixture
def api() -> Iterator[Client]:
    made = client(SETTINGS, Manners(threading.Event().wait, SETTINGS.polling.retries, inf))
    yield made
    made.http.close()
