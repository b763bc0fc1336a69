"""Charts in a real browser: values under the pointer, a brushed window, downloads, both themes, and no JavaScript."""

import re
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from time import monotonic

import databases
import monitored_building
import pytest
from api_client import client
from api_server import api_server
from browsers import closing_pages, needs_chromium
from PIL import Image
from playwright.sync_api import Browser, Page, Route
from system_chromium import chromium

from service.db import sessions as opened
from service.http.libraries import address

OF_THIS_TEST = "getImageData"
"""In a browser's warning about the pixels that this test reads."""
DRAWN = "figure[data-chart*=restoring-force] .live canvas"
CHART = "figure[data-chart*=restoring-force]"

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The paper's building after an earthquake, compared with its current model."""
    folder = tmp_path_factory.mktemp("charts")
    made = databases.sqlite(folder)
    (folder / "records").mkdir()
    monitored_building.watch(opened.sessions(made), folder / "records", monitored_building.earthquakes()[:1])
    with client(made) as api:
        for path, form in (("/buildings/PAPER/models", {"direction": "x"}), ("/models/1/accept", {})):
            assert api.post(path, data=form).status_code == 303
        assert api.post("/models/1/compare").status_code == 303
    monitored_building.work(opened.sessions(made))
    return made


@pytest.fixture(scope="module")
def started(url: str) -> Iterator[tuple[str, Browser]]:
    with api_server(url) as server, chromium() as browser:
        yield server, browser


@pytest.fixture
def browser(started: tuple[str, Browser]) -> Iterator[tuple[str, Browser]]:
    server, browser = started
    with closing_pages(browser):
        yield server, browser


@needs_chromium
def test_a_chart_answers_the_pointer_and_stays_a_picture_without_javascript(
    browser: tuple[str, Browser], tmp_path: Path
) -> None:
    server, shown_by = browser
    page = shown_by.new_page(viewport={"width": 1280, "height": 700})
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
    all_charts_show_the_same_instant(page)
    keys_zoom_move_and_reset(page)
    an_axis_is_logarithmic_or_linear(page)
    the_switch_changes_the_theme_and_is_kept(page)
    changes_are_drawn_once_and_only_near_the_screen(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    page.emulate_media(media="print")
    assert page.locator(f"{CHART} > img").is_visible()
    assert not page.locator("header button").first.is_visible()
    assert printed == [], "the browser refused something"

    still = shown_by.new_context(java_script_enabled=False, color_scheme="dark").new_page()
    still.goto(f"{server}/events/1")
    picture = still.locator(f"{CHART} > img")
    picture.scroll_into_view_if_needed()
    assert picture.is_visible()
    assert still.locator(".cursor, .readout").count() == 0
    still.wait_for_function("(chart) => document.querySelector(chart).complete", arg=f"{CHART} > img")
    assert Image.open(BytesIO(picture.screenshot())).convert("RGB").getpixel((30, 30)) == (20, 24, 31)
    with still.expect_navigation():
        still.get_by_role("link", name="Table of Restoring force, direction x").click()
    assert still.locator("tbody tr").count() > 100
    assert "restoring force (kN)" in still.inner_text("main") or "force (kN)" in still.inner_text("main")


@needs_chromium
def test_a_chart_that_a_busy_server_did_not_give_is_asked_for_again(browser: tuple[str, Browser]) -> None:
    server, shown_by = browser
    page = shown_by.new_page(viewport={"width": 1280, "height": 700})
    failures = ["no connection", "503"]

    def fails_at_first(route: Route) -> None:
        if not failures:
            route.continue_()
        elif failures.pop() == "503":
            route.fulfill(status=503)
        else:
            route.abort()

    page.route("**/charts/restoring-force.json*", fails_at_first)
    page.goto(f"{server}/events/1")
    page.locator(CHART).scroll_into_view_if_needed()
    page.get_by_role("button", name="Reset zoom: Restoring force, direction x").wait_for()
    assert failures == []


def changes_are_drawn_once_and_only_near_the_screen(page: Page) -> None:
    """A chart far from the screen waits until it comes near, and then fits.

    It is below the screen: above it, a browser may lay the page out anew before it restores the place that was shown,
    and the chart comes near for a moment.
    """
    far = "figure[data-chart*=restoring-force]"
    page.evaluate("scrollTo(0, 0)")
    page.wait_for_function(f"() => document.querySelector('{far}').getBoundingClientRect().top > innerHeight + 350")
    page.evaluate(COUNTED)
    page.set_viewport_size({"width": 320, "height": 700})
    page.wait_for_timeout(500)
    (wide,) = page.evaluate(f"charts.filter((one) => one.figure.matches('{far}')).map((one) => one.canvasWidth())")
    assert wide > 320
    assert page.evaluate("!drawings.includes('Restoring force, direction x')")
    page.locator(far).scroll_into_view_if_needed()
    page.wait_for_function(f"() => document.querySelector('{far} canvas')?.getBoundingClientRect().width <= 320")
    page.evaluate(
        f"""async () => {{
            const chart = charts.find((one) => one.figure.matches('{far}'));
            await chart.draw();
            drawings.length = 0;
            await Promise.all([1, 2, 3, 4, 5].map(() => chart.draw()));
        }}"""
    )
    assert page.evaluate("drawings.length") == 2, "one that was under way, and one for all that came meanwhile"
    for number in range(page.evaluate("charts.length")):
        page.evaluate(f"charts[{number}].figure.scrollIntoView()")
        page.wait_for_function(f"() => charts[{number}].canvasWidth() <= 320")


COUNTED = """() => {
    window.drawings = [];
    const draw = Chart.prototype.drawNow;
    Chart.prototype.drawNow = function () { drawings.push(this.title); return draw.call(this); };
}"""
"""Titles of the charts that are drawn, from now on."""


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
    page.wait_for_function(f"() => ({COUNT})() < {before / 2}")
    page.get_by_role("button", name="Reset zoom: Restoring force, direction x").click()
    page.wait_for_function(f"() => ({COUNT})() > {before / 2}")


def all_charts_show_the_same_instant(page: Page) -> None:
    """The pointer in the force history shows its time in the waveforms, the parts of the force, and the loop."""
    for chart in ("force-parts", "waveforms", "restoring-force"):
        page.locator(f"figure[data-chart*='{chart}']").first.scroll_into_view_if_needed()
        page.locator(f"figure[data-chart*='{chart}'] .cursor").first.wait_for(state="attached")
    box = page.locator(DRAWN).bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 0.75 * box["height"], steps=4)
    page.wait_for_function(
        f"() => document.querySelector('{CHART} .readout').textContent.includes('force of model x 1')"
    )
    shown = page.locator(".readout:not(:empty)").all_inner_texts()
    assert len(shown) >= 3
    assert len({text.split(" · ")[0] for text in shown}) == 1, shown
    (force,) = re.findall(
        r"(?<!parts of it, )\bforce \(kN\): (−?[\d.]+)", page.locator(f"{CHART} .readout").inner_text()
    )
    loop, step = page.evaluate(LOOP_DOT)
    assert loop == pytest.approx(float(force.replace("−", "-")), abs=step), "the loop shows another sample"
    page.mouse.move(5, 5)
    page.wait_for_function("() => [...document.querySelectorAll('.readout')].every((one) => one.textContent === '')")


LOOP_DOT = f"""() => {{
    const chart = charts.find((one) => one.area.parentElement.matches("{CHART}"));
    const {{ panel, curves, dots }} = chart.cursor.panels[0];
    const dot = dots[curves.findIndex((one) => one.names.y === "force (kN)")];
    const [low, high] = panel.scale("y").domain();
    const isShown = dot.getAttribute("visibility") === "visible";
    return [isShown && panel.scale("y").invert(dot.getAttribute("cy") - panel.top), (high - low) / 60];
}}"""
"""kN at the mark in the loop, false where it is hidden; and kN between two points of the loop, see charts.STEP."""


def keys_zoom_move_and_reset(page: Page) -> None:
    area = page.locator(f"{CHART} .live")
    whole = page.evaluate(DOMAIN)
    area.focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Shift+Tab")
    assert page.evaluate("document.activeElement.matches('.live:focus-visible')")
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    described = page.evaluate(
        "document.getElementById(document.activeElement.getAttribute('aria-describedby')).textContent"
    )
    assert "arrow keys" in described
    page.keyboard.press("+")
    page.keyboard.press("+")
    near = soon(page, DOMAIN, lambda now: now[1] - now[0] == pytest.approx((whole[1] - whole[0]) / 1.5**2))
    page.keyboard.press("ArrowRight")
    soon(page, DOMAIN, lambda now: now[0] > near[0])
    for _ in range(9):
        page.keyboard.press("ArrowRight")
    last = soon(page, DOMAIN, lambda now: now[1] == pytest.approx(whole[1]))
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(100)
    assert page.evaluate(DOMAIN) == pytest.approx(last), "it does not move beyond the record"
    page.keyboard.press("Shift+ArrowLeft")
    page.wait_for_function(f"() => document.querySelector('{CHART} .readout').textContent !== ''")
    assert page.locator(f"{CHART} .readout").get_attribute("aria-live") == "polite"
    page.keyboard.press("Escape")
    page.wait_for_function(f"(whole) => String(({DOMAIN})()) === String(whole)", arg=whole)


DOMAIN = f"""() => charts.find((one) => one.area.parentElement.matches("{CHART}")).panels.at(-1).scale("x").domain()"""
"""Times that the force history shows, s."""


@needs_chromium
def test_two_fingers_zoom_one_moves_sideways_and_scrolls_the_page(browser: tuple[str, Browser]) -> None:
    server, shown_by = browser
    page = shown_by.new_context(viewport={"width": 375, "height": 700}, has_touch=True).new_page()
    page.goto(f"{server}/events/1")
    parts = "figure[data-chart*=force-parts]"
    page.locator(parts).scroll_into_view_if_needed()
    page.locator(f"{parts} .tools").wait_for()
    page.locator(f"{parts} .live").evaluate("(one) => one.scrollIntoView({block: 'center'})")
    domain = f"""() => charts.find((one) => one.area.parentElement.matches("{parts}")).panels[0].scale("x").domain()"""
    box = page.locator(f"{parts} canvas").bounding_box()
    assert box is not None
    left, width, y = box["x"], box["width"], box["y"] + 120
    whole = page.evaluate(domain)
    fingers = page.context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        at = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

    middle = left + 0.6 * width
    touch("touchStart", (middle - 25, y))
    touch("touchStart", (middle - 25, y), (middle + 25, y))
    for apart in range(30, 80, 10):
        touch("touchMove", (middle - apart, y), (middle + apart, y))
    touch("touchEnd")
    share = 25 / 70 * (whole[1] - whole[0])
    near = soon(page, domain, lambda now: now[1] - now[0] == pytest.approx(share, rel=0.05))
    page.wait_for_function(f"() => document.querySelector('{parts} .readout').textContent !== ''")

    touch("touchStart", (middle, y))
    for moved in range(10, 70, 10):
        touch("touchMove", (middle - moved, y))
    touch("touchEnd")
    later = soon(page, domain, lambda now: now[0] > near[0] + 0.1 * (near[1] - near[0]))
    assert later[1] - later[0] == pytest.approx(near[1] - near[0])

    before = page.evaluate("scrollY")
    touch("touchStart", (middle, y))
    for moved in range(10, 160, 10):
        touch("touchMove", (middle, y - moved))
    touch("touchEnd")
    page.wait_for_function(f"() => scrollY > {before} + 50")
    assert page.evaluate(domain) == later, "a swipe that scrolls does not move the chart"


COUNT = f"""() => {{
    const canvas = document.querySelector("{DRAWN}");
    if (canvas === null) return 0;
    const pixels = canvas.getContext("2d").getImageData(0, 0, 0.4 * canvas.width, canvas.height).data;
    let count = 0;
    for (let i = 0; i < pixels.length; i += 4) count += pixels[i] < 80 && pixels[i + 2] > 130;
    return count;
}}"""
"""Blue pixels in the left part of the chart, where the loop is."""


def soon(page: Page, domain: str, holds: Callable[[list[float]], bool]) -> list[float]:
    """Domain of an axis by a script, as soon as a condition holds of it, within 10 s."""
    found: list[float]
    end = monotonic() + 10.0
    while not holds(found := page.evaluate(domain)):
        assert monotonic() < end, found
        page.wait_for_timeout(50)
    return found


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


@needs_chromium
def test_a_slider_changes_the_loop_and_the_form_works_without_javascript(browser: tuple[str, Browser]) -> None:
    server, shown_by = browser
    page = shown_by.new_page(viewport={"width": 375, "height": 700})
    printed: list[str] = []
    page.on("console", lambda message: printed.append(message.text))
    page.goto(f"{server}/effects/hardening")
    page.locator("figure.chart").scroll_into_view_if_needed()
    page.get_by_role("button", name="Reset zoom: Loop with hardening").wait_for()
    largest = "Math.max(...Object.values(charts[0].spec.datasets).flat().map((row) => row.force))"
    before = page.evaluate(largest)
    page.get_by_role("slider", name="k3").press("End")
    page.wait_for_function(f"() => {largest} > {2 * before}")
    page.wait_for_function("() => location.search.includes('k3=')")
    assert page.evaluate("document.documentElement.scrollWidth") <= 375
    assert printed == [], "the browser refused something"

    japanese = shown_by.new_context(locale="ja-JP").new_page()
    japanese.on("pageerror", lambda error: printed.append(str(error)))
    japanese.goto(f"{server}/events/1")
    japanese.locator(CHART).scroll_into_view_if_needed()
    japanese.get_by_role("button", name=re.compile("^表示範囲を戻す")).first.wait_for()
    assert "免震層の復元力" in (japanese.locator(DRAWN).get_attribute("aria-label") or "")
    assert japanese.locator(".theme").inner_text() == "暗い配色"
    assert printed == [], "the page or its chart failed in Japanese"

    still = shown_by.new_context(java_script_enabled=False).new_page()
    still.goto(f"{server}/effects/hardening")
    assert not still.locator("input[type=range]").first.is_visible()
    still.get_by_label("k3").first.fill("0.1")
    with still.expect_navigation():
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
