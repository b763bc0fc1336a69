"""Setup of all tests: a process for each core and two more, the longest files first, each computation once."""

import atexit
import gc
import os
import tempfile
from collections.abc import Generator
from pathlib import Path
from shutil import disk_usage, rmtree

os.environ.setdefault(
    "OMP_NUM_THREADS", "1"
)  # before the first import of NumPy: processes share the cores, not threads
os.environ.setdefault("MENSHIN_JOBS__KEPT_ROOM", "0")  # what one run kept would hide what the next one computes
os.environ.setdefault("MENSHIN_JOBS__WARM", "false")  # 3 s of processor time for each process of each service

import pytest
import trustme
from cached_executor import CachedExecutor

HERE = Path(__file__).parent
LONGEST = (HERE / "longest_first.txt").read_text("utf-8").split()
"""Files that take longest, the longest first: one that begins last would keep a core busy alone."""
PROCESSES = 4
"""At most: each has a PostgreSQL server of its own."""
MORE = 2
"""Processes beyond the number of cores: many slow tests wait for a lease, a poll or another process. With one more, two
cores were idle for an eighth of the time."""

GARBAGE = (50_000, 20, 20)
"""Thresholds of garbage collection, which by the usual ones takes a tenth of the time of the API's tests."""

MEMORY = Path("/dev/shm")
"""A folder in memory: tests that write a database would wait for the disk three times as long as they compute."""
ROOM = 4 * 2**30
"""Free bytes from which the tests' temporary files are there."""


def pytest_configure() -> None:
    """Temporary files in memory where it has room, and one trusted authority, unless something else was chosen."""
    if "TMPDIR" not in os.environ and os.access(MEMORY, os.W_OK) and disk_usage(MEMORY).free > ROOM:
        os.environ["TMPDIR"] = tempfile.tempdir = str(MEMORY)
    if "SSL_CERT_FILE" not in os.environ:
        _trust_one_authority()


def _trust_one_authority() -> None:
    """All processes of the run trust a new authority alone: no test speaks with others, whose certificates each client
    of a server would load, in 20 ms."""
    folder = Path(tempfile.mkdtemp(prefix="menshin-authority-"))
    atexit.register(rmtree, folder)
    trustme.CA().cert_pem.write_to_path(str(folder / "authority.pem"))
    os.environ["SSL_CERT_FILE"] = str(folder / "authority.pem")


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """None beside this process for single files and tests, which would wait for the start of others."""
    if all(Path(one.partition("::")[0]).is_file() for one in config.args):
        return 0
    return min((os.cpu_count() or 1) + MORE, PROCESSES)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """No garbage collection among the tests and modules: they live as long as this process."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(*GARBAGE)
        gc.enable()


@pytest.hookimpl(tryfirst=True)  # before tests are selected by their marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first; studies of accuracy are slow tests too."""
    items.sort(key=lambda item: _place(item.path))
    for item in items:
        if item.get_closest_marker("accuracy"):
            item.add_marker("slow")


def _place(file: Path) -> int:
    name = file.relative_to(HERE).as_posix() if file.is_relative_to(HERE) else ""
    return LONGEST.index(name) if name in LONGEST else len(LONGEST)


@pytest.fixture(scope="session", autouse=True)
def _computed_once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """A folder for results, the same for all processes of the run."""
    own = tmp_path_factory.getbasetemp()
    CachedExecutor.folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "computed"
    CachedExecutor.folder.mkdir(exist_ok=True)
