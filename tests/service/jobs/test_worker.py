"""From a queued event to its stored result, and what becomes of a job that goes wrong."""

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from datetime import timedelta
from functools import partial
from hashlib import sha256
from pathlib import Path
from threading import Event as Signal, Thread
from typing import Any

import numpy as np
import paper_records
import psutil
import pytest
from cached_executor import CachedExecutor
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.analyses.loading import load
from service.analyses.tables import Analysis, DirectionResult
from service.buildings import store as building_store
from service.db.blobs import ROUNDING, decode_history
from service.jobs import queue as job_queue, requests as job_requests
from service.jobs.executors import end, in_processes, local_processes
from service.jobs.stages import Note, Running, Stage
from service.jobs.tables import Job
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.models.warming import warm
from service.records.ingest import ingest
from service.records.tables import Event
from service.settings import Settings
from service.version import VERSION

NOW = paper_records.START + timedelta(days=1)
SETTINGS = Settings(workers=1)
PATIENCE = 240.0
"""s for a process to begin, or to load and compile everything, on a machine with other work."""


@pytest.fixture
def event_id(sessions: sessionmaker[Session]) -> int:
    """An earthquake at the paper's building, queued."""
    data = paper_records.miniseed(paper_records.records(np.random.default_rng(1)))
    with sessions.begin() as session:
        building = building_store.add(session, paper_records.building_file(), Path("/"), NOW)
        ingest(session, building, "event.mseed", "/event.mseed", data, NOW, settings=SETTINGS)
        return session.scalars(select(Event.id)).one()


def worker(sessions: sessionmaker[Session], executors: Callable[[], Executor] | None = None) -> Worker:
    return Worker(sessions, executors or CachedExecutor, SETTINGS, KINDS, clock=lambda: NOW)


class Dying(Executor):
    """Runs nothing: every computation ends as if its process had been killed."""

    def submit(self, fn, /, *args, **kwargs) -> Future:  # type: ignore[no-untyped-def, type-arg]  # noqa: ANN001, ANN002, ANN003
        future: Future[object] = Future()
        future.set_exception(RuntimeError("a process was killed"))
        return future


def test_a_result_names_all_its_inputs(sessions: sessionmaker[Session], event_id: int) -> None:
    """Computed in a process of its own, as in production, with one BLAS thread."""
    processes = local_processes(1)
    try:
        assert processes().submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
        assert worker(sessions, processes).run_until_idle() == 2  # the analysis, and a look for drift with it
    finally:
        end(processes)
    with sessions() as session:
        event = session.get_one(Event, event_id)
        assert (event.state, event.reason) == ("analysed", None)
        result = session.scalars(select(Analysis)).one()
        bytes_in = paper_records.miniseed(paper_records.records(np.random.default_rng(1)))
        assert result.inputs == [sha256(bytes_in).hexdigest()]
        assert (result.version, result.estimator, result.current) == (VERSION, "smoother", True)
        assert result.settings["band"] == [0.1, 30.0]
        assert result.pga == pytest.approx(0.7013, rel=0.05)  # the noise adds to the peak
        x = session.scalars(select(DirectionResult)).one()
        force, rigid, modal = (decode_history(blob) for blob in (x.force, x.force_rigid, x.force_modal))
        rounding = ROUNDING * (1 + 1e-3) * decode_history(x.force_std_history).min()  # the deviation is rounded too
        np.testing.assert_allclose(force, rigid + modal, rtol=0, atol=3 * rounding)  # of each of the three
        assert x.peak_force == pytest.approx(abs(force).max(), abs=rounding)
        assert x.count == force.size == decode_history(x.displacement or b"").size
        assert [mode.number for mode in x.modes] == list(range(1, len(x.modes) + 1))
        assert x.modes[0].frequency == pytest.approx(1.09, rel=5e-3)
        assert list(x.modes[0].shape) == list(paper_records.FLOORS)
        assert len(x.cycles) > 5


def progress(sessions: sessionmaker[Session]) -> dict[str, Any] | None:
    with sessions() as session:
        return session.scalars(select(Job.progress)).one()


def test_who_waits_learns_what_a_computation_is_doing(
    sessions: sessionmaker[Session], event_id: int, tmp_path: Path
) -> None:
    (notes := tmp_path / "notes").mkdir()
    telling = Worker(sessions, CachedExecutor, SETTINGS, KINDS, clock=lambda: NOW, notes=notes)
    telling.fill()
    (job,) = telling.running.values()
    assert job.note
    telling.store_progress()
    assert progress(sessions) == {"done": 0, "stages": 1, "doing": "Analysing the event", "share": 0.0}
    job.note("looking at the floors", 0, 2)
    job.note("looking at the layer", 1, 2)
    telling.store_progress()
    assert progress(sessions) == {"done": 0, "stages": 1, "doing": "looking at the layer", "share": 0.5}
    while telling.running:
        telling.collect(1.0)
    assert list(notes.iterdir()) == []


def test_the_share_that_is_done_follows_the_stages_usual_durations() -> None:
    """Three quick stages of four are a small part of the work."""
    quick, slow = (Stage("computing", str, lambda *_: (), weight=weight) for weight in (1.0, 17.0))
    claim = job_queue.Claim(1, "diagnose", None, None, None, {}, 1, 0)
    at = [Running(claim, None, (quick, quick, quick, slow), ("",) * done).share(0.5) for done in range(4)]
    assert at == pytest.approx([0.5 / 20, 1.5 / 20, 2.5 / 20, 11.5 / 20])


def test_what_a_computation_shows_where_no_one_can_read_it_is_lost_and_harms_nothing(tmp_path: Path) -> None:
    """As on a machine of a Dask cluster that has no such folder."""
    note = Note(tmp_path / "elsewhere" / "1")
    note("looking at the layer", 0, 1)
    assert note.read() is None


def test_analysing_again_makes_a_new_result_and_keeps_the_old(sessions: sessionmaker[Session], event_id: int) -> None:
    worker(sessions).run_until_idle()
    with sessions.begin() as session:
        job_queue.enqueue(session, session.get_one(Event, event_id), {"sensors": ["1F", "RF"]}, NOW)
    worker(sessions).run_until_idle()
    with sessions() as session:
        first, second = session.scalars(select(Analysis).order_by(Analysis.id))
        assert (first.current, second.current) == (False, True)
        assert (first.settings["sensors"], second.settings["sensors"]) == (None, ["1F", "RF"])
        assert first.directions[0].force != second.directions[0].force


def test_an_older_jobs_result_that_comes_late_is_not_the_current_one(
    sessions: sessionmaker[Session], event_id: int
) -> None:
    slow = worker(sessions)
    slow.fill()
    with sessions.begin() as session:
        job_queue.enqueue(session, session.get_one(Event, event_id), {"sensors": ["1F", "RF"]}, NOW)
    worker(sessions).run_until_idle()
    while slow.running:
        slow.collect(1.0)
    with sessions() as session:
        older, newer = session.scalars(select(Analysis).order_by(Analysis.job_id))
        assert (older.current, newer.current) == (False, True)


def test_a_result_is_not_written_once_another_worker_has_the_job(
    sessions: sessionmaker[Session], event_id: int
) -> None:
    stalled = worker(sessions)
    stalled.fill()
    heir = Worker(sessions, CachedExecutor, SETTINGS, KINDS, clock=lambda: NOW + timedelta(hours=1))
    assert heir.run_until_idle() == 2  # a look for drift follows
    while stalled.running:
        stalled.collect(1.0)
    with sessions() as session:
        assert session.scalars(select(Analysis)).one().created_at == NOW + timedelta(hours=1)


def test_a_lost_claim_is_noticed_and_left_alone(sessions: sessionmaker[Session], event_id: int) -> None:
    stalled = worker(sessions)
    stalled.fill()
    with sessions.begin() as session:
        assert job_queue.claim(session, NOW + timedelta(hours=1), timedelta(minutes=1))
    stalled.hold()
    assert not stalled.running


def test_a_bug_is_tried_three_times_then_shown(sessions: sessionmaker[Session], event_id: int) -> None:
    assert worker(sessions, Dying).run_until_idle() == SETTINGS.jobs.attempts
    with sessions() as session:
        job, event = session.scalars(select(Job)).one(), session.get_one(Event, event_id)
        assert (job.state, job.failures, event.state) == ("failed", 3, "failed")
        assert event.reason == "RuntimeError: a process was killed"
        assert session.scalars(select(Analysis)).all() == []


def test_a_job_that_takes_too_long_is_stopped_and_its_process_ends(
    sessions: sessionmaker[Session], event_id: int
) -> None:
    """The other job, which another process computes at the same time, goes on."""
    with sessions.begin() as session:
        job_queue.enqueue(session, session.get_one(Event, event_id), {"estimator": "cms"}, NOW, "engineer")
    settings = Settings(workers=2, job_time_limit=1000.0, job_attempts=1)
    processes = local_processes(2)
    busy = Worker(sessions, processes, settings, KINDS, clock=lambda: NOW)
    try:
        assert busy.fill() == 2
        slow, other = busy.running
        before = computing()
        assert len(before) == 2
        busy.running[slow] = replace(busy.running[slow], started=time.monotonic() - 1001.0)
        busy.is_warm = True
        busy.stop_cancelled()
        assert not busy.is_warm, "its processes are new"
        assert list(busy.running) == [other]
        while busy.running:
            busy.collect(1.0)
        assert computing() < before, "the process of the other job stayed"
    finally:
        end(processes)
    with sessions() as session:
        first, second = session.scalars(select(Job).where(Job.kind == job_queue.ANALYSE).order_by(Job.id))
        assert (first.state, second.state) == ("failed", "done")
        assert first.error is not None
        assert "stopped after 1000 s" in first.error.strip().splitlines()[-1]
        assert session.scalars(select(Analysis)).one().estimator == "cms"


def computing() -> set[int]:
    """Numbers of the processes of the pool."""
    children = psutil.Process().children(recursive=True)
    return {child.pid for child in children if "loky.backend.popen" in " ".join(child.cmdline())}


def test_a_worker_stops_computing_what_was_cancelled(sessions: sessionmaker[Session], event_id: int) -> None:
    worker(sessions).run_until_idle()
    with sessions.begin() as session:
        requested = job_queue.enqueue(
            session, session.get_one(Event, event_id), {"sensors": ["1F", "RF"]}, NOW, "engineer"
        )
        number = requested.id
    processes = local_processes(1)
    busy = worker(sessions, processes)
    try:
        assert busy.fill() == 1
        (future,) = busy.running
        with sessions.begin() as session:
            job_requests.cancel(session, session.get_one(Job, number), NOW)
        busy.stop_cancelled()
        assert not busy.running
        assert future.cancelled() or future.exception(10) is not None
        with sessions() as session:
            assert session.get_one(Job, number).state == "cancelled"
            assert session.get_one(Event, event_id).state == "analysed"
            assert session.scalars(select(Analysis)).one().settings["sensors"] is None
    finally:
        end(processes)


def test_an_event_that_failed_can_be_analysed_again(sessions: sessionmaker[Session], event_id: int) -> None:
    worker(sessions, Dying).run_until_idle()
    with sessions.begin() as session:
        job_queue.enqueue(session, session.get_one(Event, event_id), {}, NOW)
    worker(sessions).run_until_idle()
    with sessions() as session:
        assert session.get_one(Event, event_id).state == "analysed"


def test_stopping_puts_claims_back_at_once(sessions: sessionmaker[Session], event_id: int) -> None:
    stopped, stop = worker(sessions), Signal()
    stopped.fill()
    stop.set()
    stopped.run(stop)
    with sessions.begin() as session:
        assert job_queue.claim(session, NOW, timedelta(minutes=1))


@pytest.mark.sqlite  # no query is behind it
def test_a_process_is_free_for_jobs_while_another_compiles(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    os.mkfifo(compiler := tmp_path / "compiler")  # whoever reads it waits for somebody who writes
    settings = SETTINGS.model_copy(update={"jobs": SETTINGS.jobs.model_copy(update={"workers": 2, "warm": True})})
    processes = local_processes(2)
    idle = Worker(sessions, processes, settings, KINDS, warming=partial(Path.read_bytes, compiler))
    try:
        processes().submit(os.getpid).result(PATIENCE)
        idle.warm()
        idle.warm()
        first = idle.first_warmed
        assert first is not None
        processes().submit(os.getpid).result(PATIENCE)
        assert not first.done(), "the other process compiles"
        assert not idle.is_warm
    finally:
        end(processes)


def test_processes_load_what_an_analysis_needs() -> None:
    processes = local_processes(1)
    try:
        in_processes(processes, load, 1)
        modules = processes().submit(eval, "set(__import__('sys').modules)").result(PATIENCE)
        assert modules >= {"core.analysis", "core.estimators.cms", "scipy.signal", "scipy.interpolate"}
    finally:
        end(processes)


@pytest.mark.sqlite
def test_processes_of_an_idle_worker_load_what_a_diagnosis_needs(sessions: sessionmaker[Session]) -> None:
    processes = local_processes(1)
    settings = Settings(jobs={"workers": 1, "warm": True})  # as a service has it unless it is told otherwise
    idle, stop = Worker(sessions, processes, settings, KINDS, warming=warm), Signal()

    def end_once_warm() -> None:
        latest = time.monotonic() + PATIENCE
        while not idle.is_warm and time.monotonic() < latest:
            time.sleep(0.05)
        stop.set()

    ending = Thread(target=end_once_warm)
    ending.start()
    try:
        idle.run(stop)
        modules = processes().submit(eval, "set(__import__('sys').modules)").result(PATIENCE)
        assert modules >= {"core.model.force_kernels", "service.models.figures", "service.models.jobs"}
    finally:
        ending.join()
        end(processes)


@pytest.mark.parametrize("is_wanted", [True, False])
def test_no_process_starts_to_be_warmed_where_the_settings_forbid_it(
    sessions: sessionmaker[Session], is_wanted: bool
) -> None:
    given: list[object] = []
    compiled: Future[Any] = Future()

    class Listening(Executor):
        def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:  # noqa: ANN401
            given.append(function)
            return compiled

    settings = Settings(jobs={"workers": 3, "warm": is_wanted})
    idle = Worker(sessions, Listening, settings, KINDS, warming=warm)
    for _ in range(2):
        idle.warm()
        assert given == [warm][: int(is_wanted)]
    compiled.set_result(None)
    idle.warm()
    assert given == [warm, warm, warm][: 3 * is_wanted]
    assert idle.is_warm
