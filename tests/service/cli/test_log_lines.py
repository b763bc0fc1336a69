"""The log says when an earthquake arrives and what came of its analysis, at the level that the settings name."""

import json
import logging
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path

import monitored_building
import pytest
from sqlalchemy.orm import Session, sessionmaker

from service import logs
from service.settings import Settings

pytestmark = pytest.mark.slow


@pytest.fixture
def json_lines() -> Iterator[StringIO]:
    """The service's log, as JSON."""
    written = StringIO()
    handler = logging.StreamHandler(written)
    handler.setFormatter(logs.JsonLine())
    logger = logging.getLogger("service")
    before, level = logger.level, logging.INFO
    logger.addHandler(handler)
    logger.setLevel(level)
    yield written
    logger.removeHandler(handler)
    logger.setLevel(before)


def test_an_earthquake_has_a_line_when_it_arrives_and_one_when_it_is_analysed(
    sessions: sessionmaker[Session], tmp_path: Path, caplog: pytest.LogCaptureFixture, json_lines: StringIO
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
    lines = [json.loads(line) for line in json_lines.getvalue().splitlines()]
    [arrival] = [line for line in lines if line["message"] == "event 1 of PAPER: an earthquake begins to arrive"]
    assert (arrival["event"], arrival["building"]) == (1, "PAPER")
    done = [(line["event"], line["building"], line["kind"]) for line in lines if "UTC: " in line["message"]]
    assert sorted(done) == [(1, "PAPER", "analyse"), (2, "PAPER", "analyse")]


@pytest.mark.parametrize(("level", "shown"), [("debug", 3), ("info", 3), ("warning", 2), ("error", 1)])
def test_the_level_is_that_of_the_settings(level: str, shown: int) -> None:
    assert Settings(log_level=level).log_level == level  # type: ignore[arg-type]
    code = (
        "import logging; from service import logs; logs.begin(logs.LEVELS['" + level + "'], 'text'); "
        "log = logging.getLogger('service'); log.info('a'); log.warning('b'); log.error('c')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert len(done.stderr.splitlines()) == shown
    assert set(logs.LEVELS) == {"debug", "info", "warning", "error"}


def test_json_lines_say_what_they_are_about() -> None:
    code = """
import logging
from service import logs

logs.begin(logging.INFO, "json")
log = logging.getLogger("service")
log.info("%d records", 2)
with logs.about(building="TWR", event=7), logs.about(model=None, job=1):
    try:
        1 / 0
    except ZeroDivisionError:
        log.exception("地震\\nand more")
log.warning("after")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    first, second, last = map(json.loads, done.stderr.splitlines())
    assert (first["level"], first["logger"], first["message"]) == ("info", "service", "2 records")
    assert (second["message"], second["building"], second["event"], second["job"]) == ("地震\nand more", "TWR", 7, 1)
    assert "model" not in second
    assert second["exception"].endswith("ZeroDivisionError: division by zero")
    assert set(last) == {"time", "level", "logger", "message", "process", "thread"}
    assert datetime.fromisoformat(last["time"]).tzinfo == UTC
