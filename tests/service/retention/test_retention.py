"""Histories of superseded analyses are deleted on request, and nothing else is."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
import stored_histories
from processes import run
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.analyses import queries
from service.analyses.tables import Analysis, CycleResult, DirectionResult, LayerResult
from service.db.blobs import decode_history, encode_history
from service.errors import NotFoundError
from service.models.tables import ModelComparison, ModelVersion
from service.records.tables import Event
from service.retention import pruning
from service.settings import Settings

NOW = stored_histories.start(40)
DAY = timedelta(days=1)
KEEPS, PRUNES = Settings(), Settings(retention={"superseded_histories": 3600})
WHOLE = Settings(retention={"superseded_analyses": 86_400})


@pytest.fixture
def analysed_twice(sessions: sessionmaker[Session]) -> None:
    """Two earthquakes; the first of them was analysed again a day later."""
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    found = stored_histories.store_history(2)
    stored_histories.store_and_monitor(sessions, building, found, NOW)
    stored_histories.store_and_monitor(sessions, building, found[:1], NOW + DAY)


def of(kind: str, found: Sequence[pruning.Prunable]) -> pruning.Prunable:
    """Result for one kind."""
    (one,) = (one for one in found if one.kind.startswith(kind))
    return one


def pruned(sessions: sessionmaker[Session], settings: Settings, now: datetime) -> pruning.Prunable:
    """Histories that a call deletes."""
    return of("histories", pruning.prune(sessions, settings, now))


def forces(sessions: sessionmaker[Session]) -> dict[bool, list[int]]:
    """Samples of the stored forces, of superseded and of current analyses."""
    question = select(Analysis.current, DirectionResult).join(Analysis).options(undefer(DirectionResult.force))
    with sessions() as session:
        sizes: dict[bool, list[int]] = {False: [], True: []}
        for current, result in session.execute(question.order_by(Analysis.id)):
            sizes[current].append(decode_history(result.force).size)
    return sizes


@pytest.mark.usefixtures("analysed_twice")
def test_only_histories_of_superseded_analyses_go(sessions: sessionmaker[Session]) -> None:
    with sessions() as session:
        cycles = session.query(CycleResult).count()
        first = of("histories", pruning.prunable(session, PRUNES, NOW + 2 * DAY))
    assert pruned(sessions, KEEPS, NOW + 2 * DAY).rows == 0
    assert pruned(sessions, PRUNES, NOW).rows == 0  # it is not old enough
    assert first.rows == 1
    assert first.size > 0
    assert forces(sessions) == {False: [4], True: [4, 4]}
    assert pruned(sessions, PRUNES, NOW + 2 * DAY) == first
    assert pruned(sessions, PRUNES, NOW + 2 * DAY).rows == 0
    assert forces(sessions) == {False: [0], True: [4, 4]}
    with sessions() as session:
        assert session.query(CycleResult).count() == cycles
        superseded = session.scalars(select(Analysis).where(~Analysis.current)).one()
        assert queries.restoring_force(session, superseded.event_id, "x", None).length == 4
        with pytest.raises(NotFoundError, match="which a later one superseded"):
            queries.restoring_force(session, superseded.event_id, "x", superseded.id)


@pytest.mark.usefixtures("analysed_twice")
def test_histories_across_directions_go_with_the_others(sessions: sessionmaker[Session]) -> None:
    torsion = encode_history(np.ones(4))
    with sessions.begin() as session:
        for analysis in session.scalars(select(Analysis)):
            analysis.layer = LayerResult(start=NOW, rate=100.0, count=4, torsion=torsion, peak_torsion=1.0)
    assert pruned(sessions, PRUNES, NOW + 2 * DAY).size > len(torsion)
    with sessions() as session:
        kept = session.execute(
            select(Analysis.current, LayerResult.torsion, LayerResult.peak_torsion).join(LayerResult)
        )
        assert sorted(map(tuple, kept)) == [(False, None, 1.0), (True, torsion, 1.0), (True, torsion, 1.0)]


@pytest.mark.usefixtures("analysed_twice")
def test_superseded_analyses_go_with_all_their_rows(sessions: sessionmaker[Session]) -> None:
    with sessions() as session:
        superseded = session.scalars(select(Analysis).where(~Analysis.current)).one()
        event, current = superseded.event_id, set(session.scalars(select(Analysis.id).where(Analysis.current)))
        cycles = session.query(CycleResult).count()
        own = sum(len(one.cycles) for one in superseded.directions)
        assert own > 0
    assert of("superseded", pruning.prune(sessions, WHOLE, NOW + 0.5 * DAY)).rows == 0
    gone = of("superseded", pruning.prune(sessions, WHOLE, NOW + 2.5 * DAY))
    assert gone.rows == 1
    assert gone.size > 0
    with sessions() as session:
        assert set(session.scalars(select(Analysis.id))) == current
        assert session.query(CycleResult).count() == cycles - own
        assert set(session.scalars(select(DirectionResult.analysis_id))) == current
        assert queries.restoring_force(session, event, "x", None).length == 4
        with pytest.raises(NotFoundError, match=r"retention\.superseded_analyses is set"):
            queries.restoring_force(session, event, "x", superseded.id)


@pytest.mark.usefixtures("analysed_twice")
def test_histories_that_a_comparison_refers_to_stay(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        superseded = session.scalars(select(Analysis).where(~Analysis.current)).one()
        event = session.get_one(Event, superseded.event_id)
        made = {"created_at": NOW, "version": "test"}
        empty = {"effects": {}, "standard_deviations": {}, "assumed": [], "state": "draft", "change": ""}
        of_building = {"building_id": event.building_id, "revision_id": superseded.revision_id, "author": "Jo"}
        model = ModelVersion(direction="x", number=1, **empty, **of_building, **made)
        of_event = {"event_id": event.id, "analysis_id": superseded.id, "direction": "x", "role": "fitted"}
        session.add(ModelComparison(model=model, misfit={}, force=b"", **of_event, **made))
    assert pruned(sessions, PRUNES, NOW + 2 * DAY).rows == 0
    with sessions() as session:
        kept = of("histories", pruning.prunable(session, PRUNES, NOW + 2 * DAY)).kept
        of_analyses = of("superseded", pruning.prunable(session, WHOLE, NOW + 2 * DAY))
    assert kept == of_analyses.kept == {"a comparison of a model refers to it": 1}
    assert of_analyses.rows == 0
    assert forces(sessions) == {False: [4], True: [4, 4]}


@pytest.mark.slow
@pytest.mark.usefixtures("analysed_twice")
def test_a_dry_run_lists_what_the_command_would_delete(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    assert "is not set" in run(tmp_path, database_url, "prune").stdout
    age = {"MENSHIN_RETENTION__SUPERSEDED_HISTORIES": "3600"}
    would = run(tmp_path, database_url, "prune", "--dry-run", **age).stdout
    assert would.startswith("histories of superseded analyses: 1 would be deleted")
    assert forces(sessions)[False] == [4]
    assert "are deleted" in run(tmp_path, database_url, "prune", **age).stdout
    assert forces(sessions)[False] == [0]
