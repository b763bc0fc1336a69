"""Charts in a real browser: values under the pointer, a brushed window, downloads, both themes, and no JavaScript."""

from collections.abc import Iterator
from pathlib import Path
from shutil import which

import databases
import monitored_building
import pytest
from api_client import client
from api_server import api_server
from playwright.sync_api import Browser, Page, sync_playwright

from service.db import sessions as opened
from service.http.libraries import address

OF_THIS_TEST = "getImageData"
"""In a browser's warning about the pixels that this test reads."""
DRAWN = "figure[data-chart*=restoring-force] .live canvas"
CHART = "figure[data-chart*=restoring-force]"

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The paper's building after an earthquake."""
    folder = tmp_path_factory.mktemp("charts")
    made = databases.sqlite(folder)
    (folder / "records").mkdir()
    monitored_building.watch(opened.sessions(made), folder / "records", monitored_building.earthquakes()[:1])
    return made


@pytest.fixture
def browser(url: str) -> Iterator[tuple[str, Browser]]:
    with api_server(url) as server, sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=which("chromium"))
        yield server, started
        started.close()


@pytest.mark.skipif(which("chromium") is None, reason="no Chromium to look at it with")
def test_a_chart_answers_the_pointer_and_stays_a_picture_without_javascript(
    browser: tuple[str, Browser], tmp_path: Path
) -> None:
    server, chromium = browser
    page = chromium.new_page(viewport={"width": 1280, "height": 700})
    printed: list[str] = []
    page.on("console", lambda message: printed.append(message.text) if OF_THIS_TEST not in message.text else None)
    page.on("pageerror", lambda error: printed.append(str(error)))
    page.goto(f"{server}/events/1")
    page.locator(CHART).scroll_into_view_if_needed()
    page.get_by_role("button", name="Reset zoom: Restoring force, direction x").wait_for()
    assert not page.locator(f"{CHART} > img").is_visible(), "the live chart replaced the picture"
    the_pointer_shows_a_value(page)
    a_brushed_window_lights_up_in_the_loop(page)
    downloads_are_files(page, tmp_path)
    an_axis_is_logarithmic_or_linear(page)
    the_switch_changes_the_theme_and_is_kept(page)
    page.set_viewport_size({"width": 320, "height": 700})
    page.wait_for_function("() => charts.length > 0 && charts.every((one) => one.canvasWidth() <= 320)")
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    page.emulate_media(media="print")
    assert page.locator(f"{CHART} > img").is_visible()
    assert not page.locator("header button").first.is_visible()
    assert printed == [], "the browser refused something"

    still = chromium.new_context(java_script_enabled=False).new_page()
    still.goto(f"{server}/events/1")
    assert still.locator(f"{CHART} > img").is_visible()
    still.get_by_role("link", name="Table of Restoring force, direction x").click()
    assert still.locator("tbody tr").count() > 100
    assert "restoring force (kN)" in still.inner_text("main") or "force (kN)" in still.inner_text("main")


def the_pointer_shows_a_value(page: Page) -> None:
    page.locator(DRAWN).scroll_into_view_if_needed()
    box = page.locator(DRAWN).bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 0.5 * box["height"], steps=3)
    shown = page.locator("#vg-tooltip-element.visible")
    shown.wait_for()
    assert {"time (s)", "displacement (mm)", "force (kN)"} <= {
        one.strip().removesuffix(":") for one in shown.locator("td.key").all_inner_texts()
    }


def a_brushed_window_lights_up_in_the_loop(page: Page) -> None:
    """Without a window the whole loop is blue; with one the rest turns grey."""
    before = blue(page)
    box = page.locator(DRAWN).bounding_box()
    assert box is not None
    height = box["y"] + 0.75 * box["height"]
    page.mouse.move(box["x"] + 0.75 * box["width"], height)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.9 * box["width"], height, steps=8)
    page.mouse.up()
    page.wait_for_timeout(300)
    assert blue(page) < before / 2
    page.get_by_role("button", name="Reset zoom: Restoring force, direction x").click()
    page.wait_for_function(f"() => ({COUNT})() > {before / 2}")


COUNT = f"""() => {{
    const canvas = document.querySelector("{DRAWN}");
    if (canvas === null) return 0;
    const pixels = canvas.getContext("2d").getImageData(0, 0, 0.4 * canvas.width, canvas.height).data;
    let count = 0;
    for (let i = 0; i < pixels.length; i += 4) count += pixels[i] < 80 && pixels[i + 2] > 130;
    return count;
}}"""
"""Blue pixels in the left part of the chart, where the loop is."""


def blue(page: Page) -> int:
    found: int = page.evaluate(COUNT)
    return found


def downloads_are_files(page: Page, folder: Path) -> None:
    for words, start in (("PNG", b"\x89PNG"), ("SVG", b"<svg"), ("CSV", b"time (s)")):
        with page.expect_download() as coming:
            page.get_by_role("button", name=f"{words}: Restoring force, direction x").click()
        coming.value.save_as(folder / words)
        assert (folder / words).read_bytes().startswith(start)


def an_axis_is_logarithmic_or_linear(page: Page) -> None:
    title = "Equivalent stiffness of all earthquakes, direction x"
    button = page.get_by_role("button", name=f"Log or linear axis: {title}")
    assert not page.get_by_role("button", name="Log or linear axis: Restoring force, direction x").count()
    page.locator("figure[data-chart*='stiffness.json']").first.scroll_into_view_if_needed()
    button.wait_for()
    drawn = f"charts.find((one) => one.title === '{title}').view.scale('x').type"
    for expected in ("log", "linear", "log"):
        page.wait_for_function(f"() => {drawn} === '{expected}'")
        button.click()


def the_switch_changes_the_theme_and_is_kept(page: Page) -> None:
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    page.get_by_role("button", name="Dark theme").click()
    page.reload()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(20, 24, 31)"
    page.locator(CHART).scroll_into_view_if_needed()
    page.get_by_role("button", name="Reset zoom: Restoring force, direction x").wait_for()


@pytest.mark.skipif(which("chromium") is None, reason="no Chromium to look at it with")
def test_a_slider_changes_the_loop_and_the_form_works_without_javascript(browser: tuple[str, Browser]) -> None:
    server, chromium = browser
    page = chromium.new_page(viewport={"width": 375, "height": 700})
    printed: list[str] = []
    page.on("console", lambda message: printed.append(message.text))
    page.goto(f"{server}/effects/hardening")
    page.locator("figure.chart").scroll_into_view_if_needed()
    page.get_by_role("button", name="Reset zoom: Loop with hardening").wait_for()
    largest = "Math.max(...Object.values(charts[0].spec.datasets).flat().map((row) => row.force))"
    before = page.evaluate(largest)
    page.get_by_role("slider", name="k3").press("End")
    page.wait_for_function(f"() => {largest} > {2 * before}")
    assert "k3=" in page.url
    assert page.evaluate("document.documentElement.scrollWidth") <= 375
    assert printed == [], "the browser refused something"

    still = chromium.new_context(java_script_enabled=False).new_page()
    still.goto(f"{server}/effects/hardening")
    assert not still.locator("input[type=range]").first.is_visible()
    still.get_by_label("k3").first.fill("0.1")
    still.get_by_role("button", name="Show").click()
    assert "k3=0.1&" in (still.locator("figure.chart img").get_attribute("src") or "")


def test_a_library_is_kept_by_browsers_and_sent_compressed(url: str) -> None:
    with client(url, visitor=None) as api:
        path = address("vega-embed", "js")
        sent = api.get(path)
        assert sent.status_code == 200
        assert "immutable" in sent.headers["cache-control"]
        assert int(sent.headers["content-length"]) < 400_000
        assert b"vegaEmbed" in sent.content
        assert api.get(path, headers={"If-None-Match": sent.headers["etag"]}).status_code == 304
        assert api.get("/static/libraries/other.js").status_code == 404


def test_a_chart_needs_the_same_key_in_every_form(url: str) -> None:
    with client(url) as known:
        for form in ("svg", "json", "csv", "html"):
            assert known.get(f"/charts/restoring-force.{form}?result=1").status_code == 200
            assert known.get(f"/charts/restoring-force.{form}?result=99").status_code == 404
    with client(url, visitor=None) as stranger:
        for form in ("svg", "json", "csv", "html"):
            assert stranger.get(f"/charts/restoring-force.{form}?result=1").status_code == 401
