"""The tutorial quotes the actual output, its commands exist, and it can be repeated."""

import json
import re
import shlex
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

import pytest
import typer
import walk_pages
import write_tutorial
from accessible import problems
from browsers import needs_chromium
from english_left import english_left
from playwright.sync_api import Browser, Locator, Page

from service.cli import app
from service.language.choice import ENGLISH, Language, known, speaking
from service.language.translation import gettext, said

SEEN: dict[str, Any] = json.loads(write_tutorial.SEEN.read_text("utf-8"))
PNG = b"\x89PNG\r\n\x1a\n"


FITTED = 2
"""Earthquakes that the second diagnosis fits."""


def commands(line: str) -> Iterator[list[str]]:
    """Words of each command of Menshin in a line at a prompt."""
    for command in line.split("&&"):
        words = shlex.split(command)
        if words[:1] == ["menshin"]:
            yield words[1:]


def test_the_tutorial_quotes_the_actual_output() -> None:
    assert write_tutorial.PAGE.read_text("utf-8") == write_tutorial.document(SEEN), (
        "python docs/tools/write_tutorial.py would mend it"
    )


def test_its_pictures_are_there_and_small() -> None:
    shown = {
        write_tutorial.HERE / name
        for name in re.findall(r"!\[[^\]]*\]\(([^)]*)\)", write_tutorial.PAGE.read_text("utf-8"))
    }
    assert shown == set(write_tutorial.PICTURES.glob("*.png"))
    for picture in shown:
        assert picture.read_bytes().startswith(PNG)
        assert picture.stat().st_size < 200_000


def test_its_commands_and_their_options_are_there() -> None:
    lines = [line for line in write_tutorial.PAGE.read_text("utf-8").splitlines() if line.startswith("    ")]
    found = [words for line in lines for words in commands(line)]
    assert len(found) == 1 + len(write_tutorial.COMMANDS)
    for words in found:
        command: Any = typer.main.get_command(app)
        while members := getattr(command, "commands", None):
            command = members[words.pop(0)]
        known = {name for parameter in command.params for name in parameter.opts}
        assert {word for word in words if word.startswith("-")} <= known, words


def texts_of(given: object) -> Iterator[str]:
    """All texts of a building file."""
    if isinstance(given, str):
        yield given
    elif isinstance(given, dict | list):
        for one in given.values() if isinstance(given, dict) else given:
            yield from texts_of(one)


SHOWN_STILL = "main, figure.chart > img:not(details:not([open]) img)"
"""Parts of a page that are visible without JavaScript, unless a person opens more."""


def looked_at(browser: Browser, address: str, names: Iterable[str]) -> Iterator[tuple[str, list[str]]]:
    """Kind and problems of every page, with JavaScript and without it, in English and in Japanese."""
    with (
        browser.new_context() as active,
        browser.new_context(java_script_enabled=False) as inactive,
        walk_pages.reader(address) as client,
    ):
        for context in (active, inactive):
            context.set_default_timeout(1e3 * write_tutorial.PATIENCE)
        page, still = active.new_page(), inactive.new_page()
        for kind, path in walk_pages.pages(client):
            page.goto("about:blank")  # which has no charts to draw again
            page.set_viewport_size({"width": write_tutorial.WIDTH, "height": write_tutorial.HEIGHT})
            page.goto(f"{address}{path}")
            still.goto(f"{address}{path}")
            hidden = [one for one in still.locator(SHOWN_STILL).all() if not one.is_visible()]
            found = ["hidden without JavaScript"] * len(hidden)
            if not kind.startswith("/docs"):  # of programs, in English; tests/service/http/test_api_page.py looks at it
                japanese = client.get(path, headers={"Accept-Language": "ja"}).text
                found += problems(page) + [f"in English: {text}" for text in english_left(japanese, names)]
            yield kind, found


@contextmanager
def reading(browser: Browser, language: Language) -> Iterator[tuple[Page, Callable[[str], str]]]:
    """A page of a browser that prefers a language, and the texts of pages in it."""

    def text(english: str) -> str:
        with speaking(language):
            return gettext(english)

    with browser.new_context(locale=language) as context:
        context.set_default_timeout(1e3 * write_tutorial.PATIENCE)
        yield context.new_page(), text


def manage(browser: Browser, address: str, width: int, language: Language) -> None:
    """The way of a manager: buildings, the building, its alert, the last earthquake, and the report.

    Args:
        browser: of the manager.
        address: of the demonstration.
        width: pixels of the screen.
        language: preferred by the browser.
    """
    with reading(browser, language) as (page, text):
        page.set_viewport_size({"width": width, "height": 800})

        def fits() -> bool:
            needed: int = page.evaluate("document.documentElement.scrollWidth")
            return needed <= width

        page.goto(address)
        assert said("Act", language) in page.inner_text("main")
        assert fits()
        with page.expect_navigation():
            page.get_by_role("link", name="Simulated building of the paper").first.click()
        answer = page.get_by_role("region", name=text("In short")).inner_text()
        moved = re.escape(text("In the last earthquake the isolators moved %(moved)s.").partition("%")[0])
        assert re.search(moved + r"\d+ mm\W+[\d.]+ %", answer), answer
        passed = text("%(passed)s of %(all)s checks passed.") % {"passed": "A", "all": "A"}
        assert re.search(re.escape(passed).replace("A", r"\d+"), answer), answer
        assert text("Call") in answer
        assert fits()
        with page.expect_navigation():
            page.get_by_role("region", name=text("Verdict"), exact=True).locator(".alerts a").first.click()
        if page.get_by_role("button", name=text("Acknowledge")).is_visible():
            page.get_by_label(text("What you are doing about it")).fill("The engineer is on the way")
            with page.expect_navigation():
                page.get_by_role("button", name=text("Acknowledge")).click()
        assert "The engineer is on the way" in page.inner_text("main")
        assert fits()
        page.goto(f"{address}/buildings/DEMO")
        with page.expect_navigation():
            page.get_by_role("heading", name=text("last event")).get_by_role("link").first.click()
        assert text("Verdict on %(of)s") % {"of": text("this earthquake")} in page.inner_text("main")
        assert fits()
        report = page.get_by_role("link", name=text("PDF, one page")).get_attribute("href")
        answered = page.request.get(urljoin(address, report or ""))
        assert (answered.status, answered.body()[:5]) == (200, b"%PDF-")


def choose(form: Locator) -> None:
    """Fit only the earthquakes that moved the layer furthest: fewer take less time."""
    form.locator("summary").click()
    fitted = [row for row in form.locator("tbody tr").all() if row.locator("input[value=fit]").is_checked()]
    fitted.sort(key=lambda row: float(row.locator("td.number").inner_text()))
    for row in fitted[:-FITTED]:
        row.locator("input[value=aside]").check()


def improve(browser: Browser, address: str, effect: str, language: Language) -> None:
    """The way of an engineer: back to the former model, what it lacks by an earthquake's page, added, and in force.

    Args:
        browser: of the engineer.
        address: of the demonstration, whose current model has the effect.
        effect: that the former one lacks.
        language: preferred by the browser.
    """
    with reading(browser, language) as (page, text):
        page.goto(f"{address}/buildings/DEMO/models")
        models = page.request.get(f"{address}/api/v1/buildings/DEMO/models").json()["items"]
        (current,) = (one for one in models if one["state"] == "current" and one["direction"] == "x")
        page.goto(f"{address}/models/{current['id']}")
        back = text("Go back to %(direction)s %(number)s").replace("%(direction)s", "x").partition("%")[0]
        with page.expect_navigation():
            page.get_by_role("button", name=back).click()
        events = page.request.get(f"{address}/api/v1/buildings/DEMO/events").json()["items"]
        page.goto(f"{address}/events/{events[0]['id']}")
        find = re.escape(text("Find what model %(name)s lacks")).replace(re.escape("%(name)s"), "x .*")
        button = page.get_by_role("button", name=re.compile(find))
        choose(page.locator("form", has=button))
        button.click()
        page.wait_for_url("**/diagnoses/*")
        row = page.get_by_role("row").filter(has=page.get_by_role("link", name=effect, exact=True))
        row.get_by_role("button", name=text("Add")).click()
        page.wait_for_url("**/models/*")
        page.get_by_role("button", name=text("Make current")).click()
        made = urlsplit(page.url).path.rpartition("/")[2]
        errors = page.request.get(f"{address}/api/v1/models/{made}/comparisons").json()["items"]
        assert max(one["displacement_nrmse"] for one in errors) < 0.1


@pytest.mark.slow
@needs_chromium
def test_the_tutorial_can_be_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its numbers agree with the page within a tenth: estimates may have changed by so much since it was written.

    Afterwards everybody can use every page that the walk has filled: in both themes, on a telephone.
    """
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    monkeypatch.delenv("MENSHIN_JOBS__WARM", raising=False)  # idle processes are warmed, as for readers
    with write_tutorial.window() as page:
        with write_tutorial.demonstration(tmp_path) as shown:
            seen = write_tutorial.walk(page, shown, pictures)
            events = page.request.get(urljoin(page.url, "/api/v1/buildings/DEMO/events")).json()["items"]
            strongest = max(events, key=lambda one: one["pga"])["id"]
            verdict = page.request.get(urljoin(page.url, f"/api/v1/events/{strongest}/verdict")).json()
        assert verdict["level"] in ("inspect", "act")
        assert "Traceback" not in shown.printed.read_text("utf-8")
        monkeypatch.undo()
        browser = page.context.browser
        assert browser is not None
        with write_tutorial.demonstration(tmp_path) as again:
            assert again.until(lambda printed: f"your model {seen['after']['name']} is current" in printed)
            address = again.until(lambda printed: re.search(r"answers at (http://\S+)/", printed))[1]
            written = tomllib.loads((again.folder / "building.toml").read_text("utf-8"))
            unusable = dict(looked_at(browser, address, {*texts_of(written), "the demonstration"}))
            for width, language in ((1280, "en"), (375, "en"), (1280, "ja"), (375, "ja")):
                manage(browser, address, width, known(language) or ENGLISH)
            improve(browser, address, seen["set"][0], "ja")
    assert {"/", "/buildings/NAME", "/events/N", "/models/N", "/diagnoses/N", "/alerts/N", "/messages/N"} <= set(
        unusable
    )
    assert {kind: found for kind, found in unusable.items() if found} == {}
    assert "The model misses the latest 2 events" in seen["warning"]
    assert {picture.name for picture in pictures.iterdir()} == {
        file.name for file in write_tutorial.PICTURES.glob("*.png")
    }
    assert seen["set"] == SEEN["set"] == ["hardening"]
    for model in ("before", "after"):
        for fresh, written in zip(seen[model]["events"], SEEN[model]["events"], strict=True):
            assert fresh == {**written, **{k: pytest.approx(v, rel=0.1) for k, v in written.items() if k != "role"}}
    for fresh, written in zip(seen["candidates"], SEEN["candidates"], strict=True):
        assert fresh["effect"] == written["effect"]
    assert seen["after"]["events"][-1]["role"] == "later"
    assert seen["after"]["events"][-1]["displacement"] < 0.1 * seen["before"]["events"][-1]["displacement"]
