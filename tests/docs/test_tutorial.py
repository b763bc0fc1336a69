"""The tutorial quotes the actual output, its commands exist, and it can be repeated."""

import importlib.util
import json
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urljoin

import pytest
import typer

from service.cli import app

SCRIPT = importlib.util.spec_from_file_location(
    "write_tutorial", Path(__file__).resolve().parents[2] / "docs" / "tools" / "write_tutorial.py"
)
assert SCRIPT is not None
assert SCRIPT.loader is not None
writer = importlib.util.module_from_spec(SCRIPT)
SCRIPT.loader.exec_module(writer)
SEEN: dict[str, Any] = json.loads(writer.SEEN.read_text("utf-8"))
PNG = b"\x89PNG\r\n\x1a\n"


def commands(line: str) -> Iterator[list[str]]:
    """Words of each command of Menshin in a line at a prompt."""
    for command in line.split("&&"):
        words = shlex.split(command)
        if words[:1] == ["menshin"]:
            yield words[1:]


def test_the_tutorial_quotes_the_actual_output() -> None:
    assert writer.PAGE.read_text("utf-8") == writer.document(SEEN), "python docs/tools/write_tutorial.py would mend it"


def test_its_pictures_are_there_and_small() -> None:
    shown = {writer.HERE / name for name in re.findall(r"!\[[^\]]*\]\(([^)]*)\)", writer.PAGE.read_text("utf-8"))}
    assert shown == set(writer.PICTURES.glob("*.png"))
    for picture in shown:
        assert picture.read_bytes().startswith(PNG)
        assert picture.stat().st_size < 200_000


def test_its_commands_and_their_options_are_there() -> None:
    lines = [line for line in writer.PAGE.read_text("utf-8").splitlines() if line.startswith("    ")]
    found = [words for line in lines for words in commands(line)]
    assert len(found) == 1 + len(writer.COMMANDS)
    for words in found:
        command: Any = typer.main.get_command(app)
        while members := getattr(command, "commands", None):
            command = members[words.pop(0)]
        known = {name for parameter in command.params for name in parameter.opts}
        assert {word for word in words if word.startswith("-")} <= known, words


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no Chromium to walk with")
def test_the_tutorial_can_be_repeated(tmp_path: Path) -> None:
    """Its numbers agree with the page within a tenth: estimates may have changed by so much since it was written."""
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    with writer.demonstration(tmp_path) as shown, writer.window() as page:
        seen = writer.walk(page, shown, pictures)
        events = page.request.get(urljoin(page.url, "/api/v1/buildings/DEMO/events")).json()["items"]
        strongest = max(events, key=lambda one: one["pga"])["id"]
        verdict = page.request.get(urljoin(page.url, f"/api/v1/events/{strongest}/verdict")).json()
    assert verdict["level"] in ("inspect", "act")
    assert "Traceback" not in shown.printed.read_text("utf-8")
    with writer.demonstration(tmp_path) as again:
        assert again.until(lambda printed: f"your model {seen['after']['name']} is current" in printed)
    assert "The model misses the latest 2 events" in seen["warning"]
    assert {picture.name for picture in pictures.iterdir()} == {file.name for file in writer.PICTURES.glob("*.png")}
    assert seen["set"] == SEEN["set"] == ["hardening"]
    for model in ("before", "after"):
        for fresh, written in zip(seen[model]["events"], SEEN[model]["events"], strict=True):
            assert fresh == {**written, **{k: pytest.approx(v, rel=0.1) for k, v in written.items() if k != "role"}}
    for fresh, written in zip(seen["candidates"], SEEN["candidates"], strict=True):
        assert fresh["effect"] == written["effect"]
    assert seen["after"]["events"][-1]["role"] == "later"
    assert seen["after"]["events"][-1]["displacement"] < 0.1 * seen["before"]["events"][-1]["displacement"]
