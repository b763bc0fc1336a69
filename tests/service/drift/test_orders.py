"""In which order events come, how often, and how often they are analysed changes nothing in the end.

What an analysis finds is made up and truly stored, by the functions that the worker calls; what is watched is monitored
by real jobs in between, some of which are overtaken.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import pytest
import stored_histories
from hypothesis import given, settings, strategies as st
from sqlalchemy import delete, select
from sqlalchemy.orm import Session, sessionmaker

from core.analysis import EventAnalysis
from service.alerts.tables import Alert
from service.buildings import reference_periods
from service.buildings.tables import Building
from service.db import migrate, sessions as opened
from service.drift.tables import DriftAlarm, DriftState, DriftValue, MonitoredSeries
from service.jobs import queue as job_queue
from service.jobs.queue import WATCH, Claim
from service.jobs.tables import Job
from service.kinds import KINDS
from service.records.tables import Event

pytestmark = pytest.mark.slow

COUNT, ONSET = 25, 20
FINAL = stored_histories.store_history(COUNT, ONSET)
NOW = stored_histories.start(COUNT) + timedelta(days=1)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Drift rows and open alerts, without the numbers that rows happen to have."""

    rows: dict[str, Any] = field(repr=False)


@dataclass(frozen=True, slots=True)
class Step:
    """Something that happens to an event."""

    number: int
    """Number of the event."""
    found: tuple[EventAnalysis, ...]
    """Requested analyses, the last of them with all data."""
    is_overtaken: bool = False
    """True if the first of them ends after the last."""


def first_without_all(number: int) -> EventAnalysis:
    """Results from half of the record: other cycles, and values far off."""
    return stored_histories.earthquake(number, loss=0.2, gain=1.1, cycles=stored_histories.CYCLES // 2, seed=1)


def steps(dice: Random) -> list[Step]:
    """Every event comes; some come twice, some with half of their data first; in any order."""
    made: list[Step] = []
    for number, complete in enumerate(FINAL):
        half = first_without_all(number)
        ways: list[list[Step]] = [
            [Step(number, (complete,))],
            [Step(number, (complete,)), Step(number, (complete,))],
            [Step(number, (half,)), Step(number, (complete,))],
            [Step(number, (half, complete), is_overtaken=True)],
        ]
        made += dice.choices(ways, weights=(4, 1, 1, 1))[0]
    places: dict[int, list[Step]] = {}
    for step in made:
        places.setdefault(step.number, []).append(step)
    order = [step.number for step in made]
    dice.shuffle(order)
    return [places[number].pop(0) for number in order]


def take(sessions: sessionmaker[Session], building: int, step: Step, now: datetime) -> None:
    claims = []
    for _ in step.found:
        with sessions.begin() as session:
            wanted = stored_histories.queue_analysis(session, building, stored_histories.start(step.number), now)
        claims.append(claimed(sessions, wanted, now))
    pairs = list(zip(claims, step.found, strict=True))
    for claim, found in reversed(pairs) if step.is_overtaken else pairs:
        with sessions.begin() as session:
            stored_histories.store(session, claim, found, now)


def claimed(sessions: sessionmaker[Session], wanted: int, now: datetime) -> Claim:
    """The job of that number; others are put back."""
    passed: list[Claim] = []
    with sessions.begin() as session:
        while (claim := stored_histories.claim_next(session, now)).job_id != wanted:
            passed.append(claim)
        for other in passed:
            job_queue.release(session, other)
    return claim


@contextmanager
def overtaken(sessions: sessionmaker[Session], now: datetime) -> Iterator[None]:
    """A look for drift that sees nothing of what happens meanwhile, and ends after another one that does."""
    with sessions.begin() as session:
        early = job_queue.claim(session, now, stored_histories.LEASE)
        inputs = None if early is None else KINDS[WATCH].inputs(session, early, stored_histories.SETTINGS)
    yield
    stored_histories.do_waiting_work(sessions, now)
    if early is None:
        return
    with sessions.begin() as session:
        (stage,) = KINDS[WATCH].stages(inputs)
        found = stage.function(*stage.arguments((), lambda *_: None))
        if job_queue.finish(session, early, now):
            KINDS[WATCH].store(session, early, inputs, (found,), now)


def outcome(sessions: sessionmaker[Session]) -> dict[str, Any]:
    """By table."""
    with sessions() as session:
        moments = {event.id: event.start for event in session.scalars(select(Event))}
        series = {one.id: one for one in session.scalars(select(MonitoredSeries))}
        name = {key: (one.quantity, one.subject) for key, one in series.items()}
        return {
            "series": sorted((*name[key], one.wanted, _curve(one)) for key, one in series.items()),
            "values": sorted(
                (*name[one.series_id], moments[one.event_id], one.value, one.std, one.is_reference, one.is_beyond)
                for one in session.scalars(select(DriftValue))
            ),
            "alarms": sorted(
                (*name[one.series_id], one.rule, one.is_sure, moments[one.onset_event_id], one.drift, one.message)
                for one in session.scalars(select(DriftAlarm))
            ),
            "alerts": sorted(
                (one.cause, one.state, one.began_at, one.summary, [moments[event] for event in one.event_ids])
                for one in session.scalars(select(Alert).where(Alert.closed_at.is_(None)))
            ),
        }


def _curve(one: MonitoredSeries) -> Sequence[float]:
    return [] if one.baseline is None else one.baseline["coefficients"]


@contextmanager
def database(url: str) -> Iterator[sessionmaker[Session]]:
    migrate.upgrade(url)
    sessions = opened.sessions(url)
    try:
        yield sessions
    finally:
        sessions.kw["bind"].dispose()


def lived(sessions: sessionmaker[Session], taken: Sequence[Step], looks: Sequence[int]) -> dict[str, Any]:
    """Result of a building's years; drift is monitored during some of the steps."""
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    for place, step in enumerate(taken):
        now = NOW + timedelta(minutes=place)
        with overtaken(sessions, now) if place in looks else nullcontext():
            take(sessions, building, step, now)
    stored_histories.do_waiting_work(sessions, NOW + timedelta(days=1))
    with sessions() as session:
        assert set(session.scalars(select(Job.state))) == {"done"}
    return outcome(sessions)


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """Each event once, in order, and one look at the end."""
    with database(f"sqlite:///{tmp_path_factory.mktemp('expected') / 'menshin.sqlite'}") as sessions:
        found = lived(sessions, [Step(number, (one,)) for number, one in enumerate(FINAL)], ())
    assert [(cause, state) for cause, state, *_ in found["alerts"] if cause == "stiffness"] == [("stiffness", "active")]
    return Outcome(found)


def check(sessions: sessionmaker[Session], seed: int, expected: Outcome) -> None:
    dice = Random(seed)
    taken = steps(dice)
    looks = [*dice.sample(range(len(taken)), 2), len(taken) - 1]
    found = lived(sessions, taken, looks)
    assert_same(found, expected.rows)


def assert_same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    for name, rows in expected.items():
        assert len(found[name]) == len(rows), name
        for own, other in zip(found[name], rows, strict=True):
            assert all(is_same(one, another) for one, another in zip(own, other, strict=True)), (name, own, other)


def is_same(one: object, other: object) -> bool:
    """Equal, numbers but for rounding: those of one event are computed with or without the others of the building."""
    if isinstance(one, float) or (isinstance(one, list) and one and isinstance(one[0], float)):
        return bool(one == pytest.approx(other, rel=1e-9, abs=1e-12))
    return one == other


@settings(max_examples=2, deadline=None)
@given(st.integers(0, 2**32))
def test_the_order_of_arrival_changes_nothing(expected: Outcome, seed: int) -> None:
    with TemporaryDirectory() as folder, database(f"sqlite:///{Path(folder) / 'menshin.sqlite'}") as sessions:
        check(sessions, seed, expected)


def test_nor_does_it_on_either_database(sessions: sessionmaker[Session], expected: Outcome) -> None:
    check(sessions, 1, expected)


LATER = 12
"""Earthquakes after the reference."""


def test_one_more_earthquake_gives_what_all_of_them_give(sessions: sessionmaker[Session]) -> None:
    """With and without the state that the last monitoring left, after each of random changes: one more earthquake, one
    that came late, one analysed again, another reference period."""
    dice = Random(3)
    years = stored_histories.store_history_in_both(COUNT + LATER, COUNT + 4, 0.08)
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    now = stored_histories.start(COUNT + LATER) + timedelta(days=1)
    stored_histories.store_and_monitor(sessions, building, years[:COUNT], now)
    order = list(range(COUNT, COUNT + LATER))
    order[2:5] = reversed(order[2:5])
    for place, number in enumerate(order):
        found = [years[number]]
        if place == 6:
            found.append(stored_histories.earthquake(dice.choice(order[:place]), loss=0.05, seed=2))
        if place == 9:
            found.append(stored_histories.earthquake(5, seed=2))  # of the reference
        if place == 10:
            with sessions.begin() as session:
                of = session.get_one(Building, building)
                reference_periods.begin(session, of, "stiffness", None, None, None, "again", "Kimura", now)
        stored_histories.store_and_monitor(sessions, building, found, now)
        gone_on = outcome(sessions)
        with sessions.begin() as session:
            session.execute(delete(DriftState))
            job_queue.enqueue_monitoring(session, building, None, now)
        stored_histories.do_waiting_work(sessions, now)
        assert_same(gone_on, outcome(sessions))
    assert {one[0] for one in gone_on["alarms"]} >= {"stiffness", "damping"}
