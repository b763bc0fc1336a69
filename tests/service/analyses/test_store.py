"""An event has one current analysis, by a rule of the database itself; an analysis is known again by all its inputs."""

from dataclasses import replace
from datetime import timedelta

import pytest
import stored_histories
from building_models import paper, records, segments
from sqlalchemy import select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, sessionmaker

from core.analysis import AnalysisSettings
from service.analyses.store import Inputs
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


def test_a_kept_analysis_is_that_of_the_same_samples_description_and_settings() -> None:
    """A gain that a station file corrects changes the samples of the same recordings."""
    given = Inputs(tuple(segments(records(1))), paper(), AnalysisSettings(), 1, ("recorded",), "described")
    same = replace(given, segments=tuple(segments(records(1))))
    first, *others = given.segments
    changed = [
        replace(given, segments=(replace(first, samples=2 * first.samples), *others)),
        replace(given, segments=(replace(first, start=first.start + timedelta(seconds=1)), *others)),
        replace(given, segments=(replace(first, rate=200.0), *others)),
        replace(given, segments=tuple(others)),
        replace(given, description_sha256="another"),
        replace(given, settings=AnalysisSettings(band=(0.2, 30.0))),
    ]
    assert same.key == given.key
    assert len({one.key for one in (given, *changed)}) == 1 + len(changed)
