"""The tutorial quotes the actual output, its commands exist, and it can be repeated."""

import importlib.util
import json
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import urljoin

import pytest
import typer
from accessible import problems

from service.cli import app

TOOLS = Path(__file__).resolve().parents[2] / "docs" / "tools"


def tool(name: str) -> ModuleType:
    """A script of the documentation."""
    script = importlib.util.spec_from_file_location(name, TOOLS / f"{name}.py")
    assert script is not None
    assert script.loader is not None
    made = importlib.util.module_from_spec(script)
    script.loader.exec_module(made)
    return made


writer, walk = tool("write_tutorial"), tool("walk_pages")
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


SHOWN_STILL = "main, figure.chart > img:not(details:not([open]) img)"
"""What a page shows without JavaScript, unless a person opens more."""


def looked_at(address: str) -> Iterator[tuple[str, list[str]]]:
    """Kind and problems of every page, with JavaScript and without it."""
    with writer.window() as page, walk.reader(address) as client:
        assert page.context.browser is not None
        still = page.context.browser.new_context(java_script_enabled=False).new_page()
        for kind, path in walk.pages(client):
            page.goto(f"{address}{path}")
            still.goto(f"{address}{path}")
            hidden = [one for one in still.locator(SHOWN_STILL).all() if not one.is_visible()]
            yield kind, problems(page) + ["hidden without JavaScript"] * len(hidden)


def manage(address: str, width: int) -> None:
    """The way of a manager: buildings, the building, its alert, the last earthquake, and the report.

    Args:
        address: of the demonstration.
        width: pixels of the screen.
    """
    with writer.window() as page:
        page.set_viewport_size({"width": width, "height": 800})

        def fits() -> bool:
            needed: int = page.evaluate("document.documentElement.scrollWidth")
            return needed <= width

        page.goto(address)
        assert "Act" in page.inner_text("main")
        assert fits()
        page.get_by_role("link", name="Simulated building of the paper").first.click()
        answer = page.get_by_role("region", name="In short").inner_text()
        assert re.search(r"the isolators moved \d+ mm, [\d.]+ % of", answer), answer
        assert re.search(r"\d+ of \d+ checks passed.*\bCall\b", answer, re.DOTALL), answer
        assert fits()
        page.get_by_role("region", name="Verdict").locator(".alerts a").first.click()
        if page.get_by_role("button", name="Acknowledge").is_visible():
            page.get_by_label("What you are doing about it").fill("The engineer is on the way")
            page.get_by_role("button", name="Acknowledge").click()
        assert "The engineer is on the way" in page.inner_text("main")
        assert fits()
        page.goto(f"{address}/buildings/DEMO")
        page.get_by_role("link", name="last event").first.click()
        assert "Verdict on this earthquake" in page.inner_text("main")
        assert fits()
        report = page.get_by_role("link", name="PDF, one page").get_attribute("href")
        answered = page.request.get(urljoin(address, report or ""))
        assert (answered.status, answered.body()[:5]) == (200, b"%PDF-")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no Chromium to walk with")
def test_the_tutorial_can_be_repeated(tmp_path: Path) -> None:
    """Its numbers agree with the page within a tenth: estimates may have changed by so much since it was written.

    Afterwards everybody can use every page that the walk has filled: in both themes, on a telephone.
    """
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
        address = again.until(lambda printed: re.search(r"answers at (http://\S+)/", printed))[1]
        unusable = dict(looked_at(address))
        for width in (1280, 375):
            manage(address, width)
    assert {"/", "/buildings/NAME", "/events/N", "/models/N", "/diagnoses/N", "/alerts/N", "/messages/N"} <= set(
        unusable
    )
    assert {kind: found for kind, found in unusable.items() if found} == {}
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
