"""An event has one current analysis, by a rule of the database itself."""

import pytest
import stored_histories
from sqlalchemy import select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, sessionmaker

from service.analyses.tables import Analysis


def test_an_event_has_one_current_analysis(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    found = stored_histories.earthquake(0)
    stored_histories.store_and_monitor(sessions, building, [found, found], stored_histories.start(2))
    with sessions() as session:
        assert session.scalars(select(Analysis.current).order_by(Analysis.id)).all() == [False, True]
        with pytest.raises(IntegrityError):
            session.execute(update(Analysis).values(current=True))
