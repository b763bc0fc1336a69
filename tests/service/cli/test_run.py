"""The commands that run the service, as real processes.

On PostgreSQL the parts run where they are killed (jobs/test_kill.py, records/test_kill_poller.py and
notify/test_kill_notifier.py), and all together in db/test_database_comes_late.py.
"""

import re
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, sleep

import httpx
import psutil
import pytest
from monitoring_server import building_file, miniseed, stream
from processes import interrupt, run, running_command
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.records.tables import Event

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

PATIENCE = 240.0
"""s until the first analysis: at most 40 on a quiet machine, more than 60 beside ten other processes."""


def add(sessions: sessionmaker[Session], folder: Path) -> None:
    with sessions.begin() as session:
        building_store.add(session, building_file("folder", str(folder)), folder, datetime.now(UTC))


def analysed(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return len(session.scalars(select(Analysis)).all())


def test_import_and_work_until_idle(sessions: sessionmaker[Session], database_url: str, tmp_path: Path) -> None:
    add(sessions, tmp_path)
    (tmp_path / "a.mseed").write_bytes(miniseed(stream(seconds=30, locations=("00", "01"))))
    (tmp_path / "b.mseed").write_bytes(b"hello")
    imported = run(tmp_path, database_url, "import", "a.mseed", "b.mseed", "--building", "TOWER")
    assert imported.returncode == 1
    assert "a.mseed: read" in imported.stdout
    assert "b.mseed: refused: b.mseed has an unknown format (it begins with b'hello')" in imported.stdout
    done = run(tmp_path, database_url, "work", "--until-idle").stdout
    assert done == "2 jobs done\n", "the analysis, and the look for drift that follows it"
    with sessions() as session:
        assert session.scalars(select(Event)).one().state in {"analysed", "refused"}
    unknown = run(tmp_path, database_url, "import", "a.mseed", "--building", "NONE")
    assert unknown.returncode == 2
    assert "there are: TOWER" in unknown.stderr


def test_settings_are_shown_with_their_reason_and_no_password(tmp_path: Path) -> None:
    shown = run(tmp_path, "postgresql://me:hunter2@host/name", "settings", COLUMNS="300")
    assert "hunter2" not in shown.stdout
    assert "environment MENSHIN_DATABASE_URL" in shown.stdout
    narrow = run(tmp_path, "sqlite:////tmp/a/folder/with/a/long/name/menshin.sqlite", "settings", COLUMNS="80")
    assert "…" not in narrow.stdout, "names and values are complete"
    wrong = run(tmp_path, "sqlite://", "settings", MENSHIN_PORT="many")
    assert (wrong.returncode, "port" in wrong.stderr) == (2, True)


def test_everything_runs_in_one_process_tree_and_ends_cleanly(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    incoming = tmp_path / "in"
    incoming.mkdir()
    add(sessions, incoming)
    quick = {"MENSHIN_POLLING__INTERVAL": "0.5", "MENSHIN_POLLING__SETTLE_TIME": "0", "MENSHIN_JOBS__WORKERS": "1"}
    with running_command(tmp_path, database_url, "up", "--port", "0", **quick) as service:
        (incoming / "a.mseed").write_bytes(miniseed(stream(seconds=30)))
        printed = (tmp_path / "output").read_text
        end = monotonic() + PATIENCE
        while analysed(sessions) == 0 or not (served := re.search(r"serving at (http://127\.0\.0\.1:\d+)", printed())):
            assert monotonic() < end, printed()
            sleep(0.1)
        assert httpx.get(f"{served[1]}/healthz", timeout=30).status_code == 200
        children = service.children(recursive=True)
        assert interrupt(service) == 0, (tmp_path / "output").read_text()
        assert psutil.wait_procs(children, timeout=20)[1] == []
