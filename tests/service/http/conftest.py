"""A database for a whole module: these tests are about the way in, and change next to nothing."""

from collections.abc import Iterator

import pytest
from sqlalchemy.orm import Session, sessionmaker

from service.db import migrate, sessions as opened


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    address = f"sqlite:///{tmp_path_factory.mktemp('door') / 'menshin.sqlite'}"
    migrate.upgrade(address)
    return address


@pytest.fixture(scope="module")
def stored(url: str) -> Iterator[sessionmaker[Session]]:
    """Sessions at it."""
    made = opened.sessions(url)
    yield made
    made.kw["bind"].dispose()
