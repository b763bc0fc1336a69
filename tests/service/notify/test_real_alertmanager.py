"""A real Alertmanager, if Debian's package of it is installed."""

import shutil
import subprocess
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import httpx
import pytest
from rendered_messages import rendered_message

from service.demo.server import free_port
from service.notify.channels.alertmanager import ROUNDS, send
from service.notify.rendering import Destination
from service.settings import Settings

PROGRAM = shutil.which("prometheus-alertmanager")
SETTINGS = Settings(inside_allowed=("localhost",), plain_http_allowed=True, alertmanager_interval=60)
PATIENCE = 20.0
"""s until it answers."""
QUIET = "route: {receiver: nobody}\nreceivers: [{name: nobody}]\n"


@pytest.fixture
def there(tmp_path: Path) -> Iterator[str]:
    """Address of one without receivers."""
    if PROGRAM is None:
        pytest.skip("no prometheus-alertmanager is installed; Debian's package of that name would do")
    (tmp_path / "quiet.yml").write_text(QUIET)
    port = free_port(0)
    options = ("--config.file=quiet.yml", "--storage.path=kept", "--cluster.listen-address=")
    with (tmp_path / "said.txt").open("w") as printed:
        process = subprocess.Popen(
            [PROGRAM, *options, f"--web.listen-address=127.0.0.1:{port}"], cwd=tmp_path, stdout=printed, stderr=printed
        )
    try:
        address, end = f"http://localhost:{port}", monotonic() + PATIENCE
        while not _is_ready(address):
            assert monotonic() < end, (tmp_path / "said.txt").read_text()
            sleep(0.05)
        yield address
    finally:
        process.terminate()
        process.wait()


def test_an_alert_fires_changes_and_ends(there: str) -> None:
    now = datetime.now(UTC)
    began = now - timedelta(hours=3)
    usual = {"kind": "alert", "key": "alert/5", "severity": "alarm", "gravest": "alarm", "began_at": began}
    [fired] = reported(there, now, **usual, subject="softer")
    assert fired["status"]["state"] == "active"
    assert fired["labels"]["severity"] == "alarm"
    assert moment(fired["startsAt"]) == pytest.approx(began.timestamp(), abs=1e-3)  # it keeps milliseconds
    assert moment(fired["endsAt"]) == pytest.approx(now.timestamp() + 60 * ROUNDS, abs=1e-3)
    [changed] = reported(there, now, **usual, subject="softer yet", number=2, identity="msg_3", sequence="updated")
    assert changed["fingerprint"] == fired["fingerprint"]
    assert changed["annotations"]["summary"].endswith("softer yet")
    over = usual | {"severity": "note", "has_ended": True, "number": 3, "identity": "msg_4", "sequence": "updated"}
    assert reported(there, datetime.now(UTC), **over) == []


def test_a_drill_is_separate_from_real_alerts(there: str) -> None:
    now = datetime.now(UTC)
    reported(there, now, kind="alert", key="alert/5", severity="alarm", gravest="alarm", began_at=now, written_at=now)
    both = reported(there, now, kind="drill", key="drill/1", severity="alarm", gravest="alarm", written_at=now)
    assert {one["labels"]["alertname"]: one["labels"]["real"] for one in both} == {
        "MenshinAlert": "true",
        "MenshinDrill": "false",
    }


def reported(there: str, now: datetime, **of: object) -> list[dict[str, Any]]:
    """Alerts in an Alertmanager after it received a message."""
    answer = send(rendered_message(**of), Destination("manager", "alertmanager", there, None), SETTINGS, now)
    assert answer.outcome == "delivered", answer.text
    found: list[dict[str, Any]] = httpx.get(f"{there}/api/v2/alerts").json()
    return found


def moment(text: str) -> float:
    return datetime.fromisoformat(text).timestamp()


def _is_ready(address: str) -> bool:
    try:
        return httpx.get(f"{address}/-/ready").is_success
    except httpx.TransportError:
        return False
