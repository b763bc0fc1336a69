"""A building in a database of which every check can be decided."""

from collections.abc import Iterator

import pytest
from assessed_buildings import building
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.tables import Building


@pytest.fixture
def session(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions.begin() as opened:
        yield opened


@pytest.fixture
def of(session: Session) -> Building:
    return building(session)
