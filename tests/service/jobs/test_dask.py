"""Analyses run by a Dask cluster of processes of their own: the same results, by the same worker."""

import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path

import numpy as np
import paper_records
import pytest
from distributed import LocalCluster, default_client
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.analyses.tables import DirectionResult
from service.buildings import store as building_store
from service.db.blobs import decode
from service.jobs import queue as job_queue
from service.jobs.executors import executors
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.records.ingest import ingest
from service.records.tables import Event
from service.settings import Settings

NOW = paper_records.START + timedelta(days=1)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster() -> Iterator[Callable[[], Executor]]:
    """One worker process, reached by its scheduler's address as in production."""
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=logging.ERROR) as started:
        yield executors(Settings(executor="dask", dask_address=started.scheduler_address))
        default_client().close()


def test_a_dask_cluster_computes_what_this_process_does(
    sessions: sessionmaker[Session], cluster: Callable[[], Executor]
) -> None:
    assert cluster().submit(os.getpid).result() != os.getpid()
    data = paper_records.miniseed(paper_records.records(np.random.default_rng(1)))
    settings = Settings(workers=1)
    with sessions.begin() as session:
        building = building_store.add(session, paper_records.building_file(), Path("/"), NOW)
        ingest(session, building, "event.mseed", "/event.mseed", data, NOW, settings=settings)
    assert Worker(sessions, cluster, settings, KINDS, clock=lambda: NOW).run_until_idle() == 2  # and a look for drift
    with sessions.begin() as session:
        event = session.scalars(select(Event)).one()
        assert event.state == "analysed"
        job_queue.enqueue(session, event, {}, NOW)
    Worker(sessions, lambda: ThreadPoolExecutor(1), settings, KINDS, clock=lambda: NOW).run_until_idle()
    with sessions() as session:
        rows = select(DirectionResult).order_by(DirectionResult.id).options(undefer(DirectionResult.force))
        there, here = (decode(row.force) for row in session.scalars(rows))
        # sums in another order: BLAS may have another number of threads there
        np.testing.assert_allclose(there, here, rtol=0, atol=1e-9 * abs(here).max())
