"""A client of the application, without a server between them."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from service.access.roles import Caller, Role
from service.app import create
from service.settings import Settings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # starlette tells of the next httpx at import
    from fastapi.testclient import TestClient

VISITOR = Caller("loopback", Role.admin)
"""Caller without a key, until one is made: most tests do not concern access."""


@contextmanager
def client(
    url: str,
    host: str = "127.0.0.1",
    name: str = "127.0.0.1:8000",
    scheme: str = "http",
    visitor: Caller | None = VISITOR,
    **settings: object,
) -> Iterator[TestClient]:
    """A client of the application on this database, from `host`, by the name in the address; redirects stay visible."""
    app = create(Settings(database_url=url, **settings), visitor)
    with TestClient(app, base_url=f"{scheme}://{name}", client=(host, 40000), follow_redirects=False) as made:
        yield made
