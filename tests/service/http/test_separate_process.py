"""`menshin up` serves from a separate process, whose end affects no other part."""

import re
import resource
import signal
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from time import monotonic, sleep

import httpx
import psutil
import pytest
from processes import interrupt, running_command
from raw_http import connect

pytestmark = pytest.mark.slow
PATIENCE = 240.0
"""s, on a machine with other work: two processes import everything."""
FILES = 240
"""Number of files that the API's process may open."""


def until(met: Callable[[], object], why: Callable[[], str]) -> object:
    end = monotonic() + PATIENCE
    while True:
        try:
            if found := met():
                return found
        except (httpx.TransportError, psutil.NoSuchProcess):
            pass
        assert monotonic() < end, why()
        sleep(0.1)


def test_an_api_that_dies_or_is_flooded_is_back_and_the_others_go_on(url: str, tmp_path: Path) -> None:
    quick = {"MENSHIN_POLLING__INTERVAL": "0.5", "MENSHIN_JOBS__WORKERS": "1", "MENSHIN_MAX_CONNECTIONS": "16"}
    with running_command(tmp_path, url, "up", "--port", "0", **quick) as service:
        printed = (tmp_path / "output").read_text
        address = str(until(lambda: re.search(r"(http://127\.0\.0\.1:\d+)/login\?token=ml_", printed()), printed)[1])  # type: ignore[index]
        until(lambda: httpx.get(f"{address}/readyz").status_code == 200, printed)

        served = next(one for one in service.children(recursive=True) if one.net_connections("tcp"))
        resource.prlimit(served.pid, resource.RLIMIT_NOFILE, (FILES, FILES))
        with ExitStack() as stack:
            for _ in range(2 * FILES):
                stack.enter_context(connect(address))
            assert httpx.get(f"{address}/readyz", timeout=30).status_code == 200
        assert len(printed()) < 20_000

        served.kill()
        until(lambda: "the API ended by itself with exit code -9" in printed(), printed)
        until(lambda: httpx.get(f"{address}/readyz").status_code == 200, printed)
        assert service.is_running()
        left = service.children(recursive=True)
        assert interrupt(service, signal.SIGINT) == 0, printed()
        assert psutil.wait_procs(left, timeout=20)[1] == []
        assert "Traceback" not in printed()


def test_the_api_ends_with_a_parent_that_is_killed(url: str, tmp_path: Path) -> None:
    with running_command(tmp_path, url, "up", "--port", "0", MENSHIN_JOBS__WORKERS="1") as service:
        printed = (tmp_path / "output").read_text
        until(lambda: "serving at" in printed(), printed)
        left = service.children(recursive=True)
        service.kill()
        service.wait()
        assert psutil.wait_procs(left, timeout=20)[1] == []
