"""Analyses run by a Dask cluster of other processes: the same results, whatever of the cluster dies meanwhile."""

import os
import pickle
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager
from datetime import timedelta
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import paper_records
import psutil
import pytest
import trustme
from api_client import client as opened_client
from monitoring_server import START, building_file, miniseed, stream
from namespaces import WHY, namespace
from processes import interrupt, kill_tree, running_command
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.analyses.tables import Analysis, DirectionResult
from service.buildings import store as building_store
from service.db.blobs import decode
from service.db.sessions import STALLED
from service.demo.server import free_port
from service.jobs import queue as job_queue
from service.jobs.cluster import GRACE, Cluster, dask_cluster
from service.jobs.executors import LostComputationError, end
from service.jobs.tables import Job, Lease
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.records.ingest import ingest
from service.records.tables import Event
from service.roles import executors
from service.settings import Settings

NOW = paper_records.START + timedelta(days=1)
FILES = 3
PATIENCE = 120.0
"""s for a process to start, on a machine with other work."""
OLDER = "Metadata-Version: 2.1\nName: menshin\nVersion: 0.0.9\n"
PASSWORD = "correct horse"

pytestmark = pytest.mark.slow


def until(met: Callable[[], bool], seconds: float = PATIENCE) -> None:
    latest = monotonic() + seconds
    while not met():
        assert monotonic() < latest, "it did not happen in time"
        sleep(0.1)


@contextmanager
def process(
    folder: Path, module: str, *arguments: str, before: tuple[str, ...] = (), **more: str
) -> Iterator[psutil.Popen]:
    """A process of Dask without our settings, which nobody starts again; nothing of it is left afterwards."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MENSHIN_")}
    command = [*before, sys.executable, "-m", f"distributed.cli.{module}", *arguments, "--no-dashboard"]
    with (folder / f"{module}.log").open("ab") as log:
        started = psutil.Popen(command, cwd=folder, env=kept | more, stdout=log, stderr=log)
    try:
        yield started
    finally:
        kill_tree(started)


def scheduler(
    folder: Path, address: str, *more: str, before: tuple[str, ...] = ()
) -> AbstractContextManager[psutil.Popen]:
    host, port = address.partition("://")[2].split(":")
    return process(folder, "dask_scheduler", "--host", host, "--port", port, *more, before=before)


def worker(
    folder: Path, address: str, *more: str, before: tuple[str, ...] = (), **others: str
) -> AbstractContextManager[psutil.Popen]:
    single = ("--nthreads", "1", "--no-nanny", "--local-directory", str(folder))
    return process(folder, "dask_worker", address, *single, *more, before=before, **others)


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[tuple[str, tuple[str, ...]]]:
    """This machine's address as another network namespace sees it, and what runs a command there; the loopback where
    no namespace can be made."""
    with namespace() as other:
        yield ("127.0.0.1", ()) if other is None else (other.address, other.inside)


@pytest.fixture(scope="module")
def address(elsewhere: tuple[str, tuple[str, ...]], tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a scheduler whose one worker is in another network namespace, where that is possible."""
    folder, (host, before) = tmp_path_factory.mktemp("dask"), elsewhere
    found = f"tcp://{host}:{free_port(0)}"
    with scheduler(folder, found), worker(folder, found, before=before):
        yield found


@pytest.fixture(scope="module")
def cluster(address: str) -> Iterator[Callable[[], Executor]]:
    made = executors(Settings(executor="dask", dask_address=address))
    until(lambda: made().trouble() is None)  # type: ignore[attr-defined]  # a Cluster
    yield made
    end(made)


class Overhearing(Executor):
    """Keeps what is sent to the cluster."""

    def __init__(self, cluster: Callable[[], Executor]) -> None:
        self.cluster, self.sent = cluster, list[bytes]()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:  # noqa: ANN401  as given
        self.sent.append(pickle.dumps((fn, args, kwargs)))
        return self.cluster().submit(fn, *args, **kwargs)


@pytest.mark.sqlite
def test_a_dask_cluster_computes_what_this_process_does(
    sessions: sessionmaker[Session], cluster: Callable[[], Executor]
) -> None:
    """Its worker gets no setting, and has nothing that could reach a database."""
    url = str(sessions.kw["bind"].url)
    settings = Settings(database_url=url, workers=1, smtp={"host": "mail", "user": "menshin", "password": PASSWORD})
    data = paper_records.miniseed(paper_records.records(np.random.default_rng(1)))
    with sessions.begin() as session:
        building = building_store.add(session, paper_records.building_file(), Path("/"), NOW)
        ingest(session, building, "event.mseed", "/event.mseed", data, NOW, settings=settings)
    overhearing = Overhearing(cluster)
    assert Worker(sessions, lambda: overhearing, settings, KINDS, clock=lambda: NOW).run_until_idle() == 2
    assert len(overhearing.sent) == 2, "the analysis, and a look for drift"
    assert not any(secret.encode() in sent for secret in (url, PASSWORD) for sent in overhearing.sent)
    there_too = cluster().submit(eval, "[*__import__('sys').modules, *__import__('os').environ]").result(PATIENCE)
    assert "core.analysis" in there_too
    assert not [name for name in there_too if name.startswith(("sqlite3", "psycopg", "MENSHIN_"))], "no driver"
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


def test_the_worker_is_in_another_network(
    cluster: Callable[[], Executor], elsewhere: tuple[str, tuple[str, ...]]
) -> None:
    if not elsewhere[1]:
        pytest.skip(WHY)
    network = "/proc/self/ns/net"
    assert cluster().submit(os.readlink, network).result(PATIENCE) != os.readlink(network)


def test_work_goes_on_after_a_worker_and_the_scheduler_have_died(
    database_url: str, sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    now = START + timedelta(days=30)
    with sessions.begin() as session:
        building = building_store.add(session, building_file(), Path("/"), now)
        for number in range(FILES):
            data = miniseed(stream(START + timedelta(hours=number), seconds=30, seed=number))
            ingest(session, building, f"{number}.mseed", f"/{number}", data, now, settings=Settings())

    def states() -> list[str]:
        with sessions() as session:
            return list(session.scalars(select(Job.state).where(Job.kind == job_queue.ANALYSE)))

    def is_waiting() -> bool:
        with sessions() as session:
            return session.scalars(select(Lease.trouble)).one_or_none() is not None

    found = f"tcp://127.0.0.1:{free_port(0)}"
    asked = ("work", "--executor", "dask", "--dask-address", found, "--workers", "1")
    with running_command(tmp_path, database_url, *asked) as work, ExitStack() as stack:
        until(is_waiting)
        with opened_client(database_url) as api:
            assert "the worker waits: the Dask scheduler at" in api.get("/readyz").json()["detail"]
            assert "menshin_worker_waits 1.0" in api.get("/metrics").text
        with scheduler(tmp_path, found) as first:
            with worker(tmp_path, found) as dying:
                until(lambda: "running" in states())
                dying.kill()
                dying.wait()
            second = stack.enter_context(worker(tmp_path, found))
            until(lambda: "done" in states() and "running" in states())
            first.kill()
            first.wait()
        until(is_waiting)
        assert "running" not in states()
        assert second.wait(PATIENCE) is not None, "a worker ends without its scheduler, to be started again"
        stack.enter_context(scheduler(tmp_path, found))
        stack.enter_context(worker(tmp_path, found))
        until(lambda: states() == ["done"] * FILES)
        assert not is_waiting()
        assert interrupt(work) == 0
    with sessions() as session:
        assert len(set(session.scalars(select(Analysis.event_id)))) == len(session.scalars(select(Analysis)).all()) == 3
        assert set(session.scalars(select(Job.failures))) == {0}
    printed = (tmp_path / "output").read_text()
    assert "Traceback" not in printed
    assert f"work waits: the Dask scheduler at {found} cannot be reached" in printed
    assert f"the Dask cluster at {found} computes again" in printed


def test_other_versions_are_refused_in_words_until_they_are_gone(tmp_path: Path) -> None:
    older = tmp_path / "older" / "menshin-0.0.9.dist-info"
    older.mkdir(parents=True)
    (older / "METADATA").write_text(OLDER)
    found = f"tcp://127.0.0.1:{free_port(0)}"
    cluster = Cluster(found)
    try:
        with scheduler(tmp_path, found):
            with worker(tmp_path, found, PYTHONPATH=str(older.parent)) as wrong:
                until(lambda: "has menshin 0.0.9" in (cluster.trouble() or ""))
                trouble = cluster.trouble() or ""
                assert f"this process has menshin {cluster._own['menshin']}; install the same" in trouble
                late = cluster.submit(os.getpid).exception(PATIENCE)
                assert isinstance(late, LostComputationError), "nor is anything computed before one looks"
                assert "menshin 0.0.9" in str(late)
                assert wrong.is_running()
            with worker(tmp_path, found) as right:
                until(lambda: cluster.trouble() is None)
                assert cluster.submit(os.getpid).result(PATIENCE) == right.pid
    finally:
        cluster.shutdown()


@pytest.mark.parametrize(
    ("other", "found"),
    [
        ({"python": "3.10.2.final.0"}, "python 3.10"),
        ({"dask": "2020.1.0", "distributed": "2020.1.1"}, "dask 2020.1.0 and distributed 2020.1.1"),
        ({"distributed": None}, "distributed None"),
        ({"python": "{python}.99.final.0", "numpy": "1.0"}, None),
    ],
)
def test_a_scheduler_of_other_versions_is_refused_in_words(other: dict[str, str | None], found: str | None) -> None:
    cluster = Cluster("tcp://scheduler:8786")
    same = {name: cluster._own[name] for name in ("python", "dask", "distributed")}
    given = {name: version and version.format(**same) for name, version in other.items()}
    trouble = cluster._difference(same | given)
    if found is None:
        assert trouble is None, "a scheduler needs neither NumPy nor the same patch of Python"
    else:
        assert trouble is not None
        assert trouble.startswith(f"the Dask scheduler at tcp://scheduler:8786 has {found}, and this process has ")
        assert trouble.endswith("install the same versions in both, by one image or lock file")


def test_a_network_to_the_scheduler_that_loses_everything_is_noticed(tmp_path: Path) -> None:
    with namespace(loopback=True) as other:
        if other is None:
            pytest.skip(WHY)
        found = f"tcp://{other.there}:{free_port(0)}"
        cluster = Cluster(found)
        try:
            with (
                scheduler(tmp_path, found, before=other.inside),
                worker(tmp_path, found, before=other.inside),
            ):
                until(lambda: cluster.trouble() is None)
                waiting = cluster.submit(sleep, 600)
                other.cut()
                begun = monotonic()
                longest = 0.0
                while not waiting.done() and monotonic() - begun < PATIENCE:
                    looked = monotonic()
                    cluster.trouble()
                    longest = max(longest, monotonic() - looked)
                    sleep(0.5)
                assert isinstance(waiting.exception(0), LostComputationError)
                assert "cannot be reached" in (cluster.trouble() or "")
                assert monotonic() - begun < 2 * STALLED
                assert longest < STALLED
        finally:
            cluster.shutdown()


def test_computations_are_taken_back_where_no_worker_comes(tmp_path: Path) -> None:
    found, times = f"tcp://127.0.0.1:{free_port(0)}", [0.0]
    cluster = Cluster(found, timer=lambda: times[-1])
    try:
        with scheduler(tmp_path, found):
            until(lambda: times.append(times[-1] + 3) or "no worker" in (cluster.trouble() or ""))  # type: ignore[func-returns-value]
            waiting = cluster.submit(os.getpid)
            for later, is_over in ((0.9 * GRACE, False), (0.2 * GRACE, True)):
                times.append(times[-1] + later)
                cluster.trouble()
                assert waiting.done() == is_over
            assert isinstance(waiting.exception(), LostComputationError)
    finally:
        cluster.shutdown()


def test_a_cluster_with_tls_lets_in_who_has_its_certificate(tmp_path: Path) -> None:
    authority = trustme.CA()
    own = authority.issue_cert("127.0.0.1", "menshin.example.org")
    files = {name: tmp_path / f"{name}.pem" for name in ("ca", "certificate", "key")}
    authority.cert_pem.write_to_path(files["ca"])
    own.cert_chain_pems[0].write_to_path(files["certificate"])
    own.private_key_pem.write_to_path(files["key"])
    options = (
        "--tls-ca-file",
        str(files["ca"]),
        "--tls-cert",
        str(files["certificate"]),
        "--tls-key",
        str(files["key"]),
    )
    found = f"tls://127.0.0.1:{free_port(0)}"
    settings = Settings(
        jobs={"executor": "dask", "dask_address": found} | {f"dask_tls_{name}": file for name, file in files.items()}
    )
    made, stranger = dask_cluster(settings.jobs), Cluster(found.replace("tls", "tcp"))
    try:
        with scheduler(tmp_path, found, "--protocol", "tls", *options), worker(tmp_path, found, *options) as there:
            until(lambda: made().trouble() is None)  # type: ignore[attr-defined]  # a Cluster
            assert made().submit(os.getpid).result(PATIENCE) == there.pid
            assert "cannot be reached" in (stranger.trouble() or "")
    finally:
        end(made)
        stranger.shutdown()
