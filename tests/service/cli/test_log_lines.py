"""The log says when an earthquake arrives and what came of its analysis, at the level that the settings name."""

import logging
import subprocess
import sys
from pathlib import Path

import monitored_building
import pytest
from sqlalchemy.orm import Session, sessionmaker

from service import logs
from service.settings import Settings

pytestmark = pytest.mark.slow


def test_an_earthquake_has_a_line_when_it_arrives_and_one_when_it_is_analysed(
    sessions: sessionmaker[Session], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    monitored_building.watch(sessions, tmp_path, monitored_building.earthquakes()[2:])
    printed = [record.getMessage() for record in caplog.records if record.name.startswith("service")]
    assert printed.count("event 1 of PAPER: an earthquake begins to arrive") == 1
    [analysed] = [line for line in printed if line.startswith("event 1 of PAPER, 2024-05-04 06:07:08 UTC: analysed; ")]
    assert analysed.endswith(" mm in direction x")
    assert any(
        line.startswith("event 2 of PAPER, 2024-06-03 06:07:08 UTC: could not be analysed: ") for line in printed
    )


@pytest.mark.parametrize(("level", "shown"), [("debug", 3), ("info", 3), ("warning", 2), ("error", 1)])
def test_the_level_is_that_of_the_settings(level: str, shown: int) -> None:
    assert Settings(log_level=level).log_level == level  # type: ignore[arg-type]
    code = (
        "import logging; from service import logs; logs.begin(logs.LEVELS['" + level + "']); "
        "log = logging.getLogger('service'); log.info('a'); log.warning('b'); log.error('c')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert len(done.stderr.splitlines()) == shown
    assert set(logs.LEVELS) == {"debug", "info", "warning", "error"}
