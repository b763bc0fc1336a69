"""A building in a database, for tests of its messages."""

from collections.abc import Iterator

import pytest
from alert_fixtures import building
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.tables import Building


@pytest.fixture
def session(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions.begin() as opened:
        yield opened


@pytest.fixture
def of(session: Session) -> Building:
    return building(session)
