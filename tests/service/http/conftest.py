"""A database for a whole module: these tests are about the way in, and change next to nothing."""

from collections.abc import Iterator

import databases
import pytest
from sqlalchemy.orm import Session, sessionmaker

from service.db import sessions as opened


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    return databases.sqlite(tmp_path_factory.mktemp("door"))


@pytest.fixture(scope="module")
def stored(url: str) -> Iterator[sessionmaker[Session]]:
    """Sessions at it."""
    made = opened.sessions(url)
    yield made
    made.kw["bind"].dispose()
