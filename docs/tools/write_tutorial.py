"""Write docs/models/tutorial.md and its pictures by walking through the demonstration.

    python docs/tools/write_tutorial.py

It needs a Chromium and about five minutes. What the walk saw is stored in docs/models/tutorial/seen.json;
no number on the page is typed by hand.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar
from urllib.parse import urljoin, urlsplit

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from playwright.sync_api import FloatRect, Locator, Page
from system_chromium import chromium

from service.demo.hidden_effect import RUBBER

HERE = Path(__file__).parents[1] / "models"
PAGE, PICTURES = HERE / "tutorial.md", HERE / "tutorial"
SEEN = PICTURES / "seen.json"
PATIENCE = 300.0
"""s, for any one thing to happen on a busy machine."""
LOOKS = 10
"""Looks at a part of a page that is not there, a second apart."""
WIDTH, HEIGHT = 1120, 800
"""Pixels of the browser's window."""
MARGIN = 4
"""Pixels, around what a picture is to show."""
FIGURES = {"loop": "Loop of the strongest", "help": "Effects that would reduce"}
"""Pictures of a diagnosis, by what their captions begin with."""
RECORDS = "records/[1-5].mseed records/station.xml --building building.toml --hold-out records/6.mseed"
FIRST = "records/[1-3].mseed records/station.xml --building building.toml"
COMMANDS = {
    "new": "menshin model new --building building.toml --direction x -o design.toml",
    "fit": f"menshin model fit design.toml {FIRST} -o weak.toml",
    "compare": "menshin model compare weak.toml records/[1-6].mseed records/station.xml --building building.toml",
    "diagnose": f"menshin model diagnose weak.toml {RECORDS} --html lacks.html",
    "add": f"menshin model add hardening weak.toml {RECORDS} -o better.toml",
}
SHOWN = {
    "compare": ("Force, driven by", "Peak: of the"),
    "diagnose": ("Hardening of", "Effects tried"),
    "add": ("Error of the force", "Error of the response"),
}
"""Between which words the page shows what they print."""
Answer = TypeVar("Answer")
Seen = dict[str, Any]
"""Results of a walk, as JSON: errors in percent, peaks in mm and gal, values in SI."""


@dataclass(frozen=True, slots=True)
class Demonstration:
    """`menshin demo --hidden-effect` at work."""

    process: subprocess.Popen[bytes]
    folder: Path
    """Folder of its files."""
    printed: Path
    """Its printed text."""

    def until(self, found: Callable[[str], Answer | None]) -> Answer:
        """Matches in its printed text, once there are any.

        Raises:
            RuntimeError: it ended, or the time is up.
        """
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and self.process.poll() is None:
            answer = found(self.printed.read_text("utf-8"))
            if answer:
                return answer
            time.sleep(0.5)
        raise RuntimeError(f"it did not come to pass; the demonstration printed:\n{self.printed.read_text('utf-8')}")


@contextmanager
def demonstration(folder: Path) -> Iterator[Demonstration]:
    """A separate demonstration, started anew and ended by Ctrl-C."""
    said = folder / "said.txt"
    menshin = Path(sys.executable).with_name("menshin")
    with said.open("wb") as output:
        process = subprocess.Popen(
            [menshin, "demo", "--hidden-effect", "--folder", folder, "--port", "0"],
            stdout=output,
            stderr=subprocess.STDOUT,
            env={**os.environ, "COLUMNS": "120"},
            start_new_session=True,
        )
    try:
        yield Demonstration(process, folder / "hidden-effect", said)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
        process.wait(timeout=30)


@contextmanager
def window() -> Iterator[Page]:
    """A page of a browser."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_default_timeout(1e3 * PATIENCE)
        yield page


def walk(page: Page, shown: Demonstration, pictures: Path) -> Seen:
    """The pages of an engineer who finds the hidden effect by the pages alone; the pictures are PNGs in a folder."""
    opened = shown.until(lambda said: re.search(r"1\. open (\S+)/models/(\d+).*records lie in", said, re.DOTALL))
    address, number = opened[1], int(opened[2])
    page.goto(f"{address}/models/{number}")
    before = {"steps": _steps(shown.printed.read_text("utf-8"), address)} | _failing(page, number, pictures)
    found = _diagnosed(page, pictures)
    told = _improved(page, found["set"][0], shown)
    return before | found | told | _better(page, pictures)


def _failing(page: Page, number: int, pictures: Path) -> Seen:
    """The model as it is found."""
    _picture(page, pictures / "misses.png", "h2", ".charts")
    warning = page.locator(".findings .warning").inner_text().removeprefix("warning ")
    return {"before": _model(page, number), "warning": warning}


def _diagnosed(page: Page, pictures: Path) -> Seen:
    """The diagnosis, from the page of the latest event."""
    latest = _asked(page, "/buildings/DEMO/events")["items"][0]["id"]
    page.goto(urljoin(page.url, f"/events/{latest}"))
    page.get_by_text("Choose others").click()
    _picture(page, pictures / "choice.png", "h3:text('Models of the isolation layer')", "button:text('Find what')")
    page.get_by_role("button", name="Find what").click()
    page.wait_for_url("**/diagnoses/*")
    found = _asked(page, f"/diagnoses/{_number(page)}")
    for name, title in FIGURES.items():
        _live(page, title).screenshot(path=pictures / f"{name}.png")
    _picture(page, pictures / "lacks.png", "h2", "figure")
    return {
        "outcome": found["outcome"],
        "set": found["set"],
        "said": page.locator(".said p").all_inner_texts(),
        "candidates": [
            {name: one[name] for name in ("effect", "error_after", "error_after_held_out")}
            for one in found["candidates"][:2]
        ],
        "versions": {
            one["name"]: [100 * one[group]["nrmse"] for group in ("error", "error_held_out")]
            for one in found["versions"]
        },
    }


def _live(page: Page, title: str) -> Locator:
    """The figure whose caption begins with a title, once its chart is drawn.

    Raises:
        RuntimeError: it stays a still picture.
    """
    figure = page.locator("figure", has_text=title).first
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        figure.scroll_into_view_if_needed()  # what is above it may have grown
        if figure.get_by_role("button", name="Reset zoom").is_visible():
            return figure
        page.wait_for_timeout(500)
    raise RuntimeError(f"{page.url} keeps a still picture of {title!r}")


def _improved(page: Page, effect: str, shown: Demonstration) -> Seen:
    """The effect added, the model that has it made current, and what the demonstration says to that."""
    row = page.get_by_role("row").filter(has=page.get_by_role("link", name=effect, exact=True))
    row.get_by_role("button", name="Add").click()
    page.wait_for_url("**/models/*")
    page.get_by_role("button", name="Make current").click()
    told = shown.until(lambda said: re.search(r"(an earthquake of .*?)\n.*(no model was .*?);", said, re.DOTALL))
    return {"told": [" ".join(line.split()) for line in told.groups()]}


def _better(page: Page, pictures: Path) -> Seen:
    """The model that was made, after one more earthquake."""
    page.reload()
    _picture(page, pictures / "meets.png", "h2", ".charts")
    lineage = "section:has(h3:text('Lineage'))"
    _picture(page, pictures / "lineage.png", lineage, lineage)
    return {"after": _model(page, _number(page))}


def _number(page: Page) -> int:
    """Number that the page shows."""
    return int(urlsplit(page.url).path.rpartition("/")[2])


def _asked(page: Page, address: str) -> Seen:
    """Response of the API."""
    answer: Seen = page.request.get(urljoin(page.url, f"/api/v1{address}")).json()
    return answer


def _model(page: Page, number: int) -> Seen:
    """Errors of a version in percent, and its values."""
    model = _asked(page, f"/models/{number}")
    return {
        "name": f"{model['direction']} {model['number']}",
        "events": [_event(page, row) for row in _asked(page, f"/models/{number}/comparisons")["items"]],
        "parameters": {f"{one['effect']}.{one['parameter']}": one["value"] for one in model["values"]},
    }


def _event(page: Page, row: Seen) -> Seen:
    event = _asked(page, f"/events/{row['event']}")
    (along,) = (one for one in event["directions"] if one["direction"] == row["direction"])
    return {
        "role": row["role"],
        "acceleration": 100 * event["pga"],
        "peak": 1e3 * along["peak_displacement"],
        "force": 100 * row["nrmse"],
        "displacement": 100 * row["displacement_nrmse"],
    }


def _picture(page: Page, path: Path, first: str, last: str) -> None:
    """Everything from the top of one element to the bottom of another."""
    for _ in range(LOOKS):  # a part of the page may just be replaced by a newer one
        top, bottom = (page.locator(name).first.bounding_box() for name in (first, last))
        if top is not None and bottom is not None:
            break
        page.wait_for_timeout(1e3)
    if top is None or bottom is None:
        raise RuntimeError(f"{page.url} shows no {first}, or no {last}")
    height = bottom["y"] + bottom["height"] - top["y"] + 2 * MARGIN
    scrolled: float = page.evaluate("scrollY")  # boxes count from the top of the window
    clip = FloatRect(x=0.0, y=max(0.0, top["y"] + scrolled - MARGIN), width=WIDTH, height=height)
    page.screenshot(path=path, full_page=True, clip=clip)


def _steps(said: str, address: str) -> str:
    """Text that the demonstration prints for its spectator, at its default address."""
    begin, end = said.index("The current model misses"), said.index("the records lie in")
    return said[begin:end].strip().replace(address, "http://127.0.0.1:8000")


def typed(folder: Path) -> dict[str, str]:
    """The part of what the commands of COMMANDS print that the page shows, in the demonstration's folder."""
    printed = {name: _printed(command, folder) for name, command in COMMANDS.items()}
    return {name: _between(printed[name], *ends) for name, ends in SHOWN.items()}


def _between(printed: str, begin: str, end: str) -> str:
    at = printed.index(begin)
    return "\n".join(line.rstrip() for line in printed[at : printed.index(end, at)].strip().splitlines())


def _printed(command: str, folder: Path) -> str:
    at_hand = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    environment = {**os.environ, "COLUMNS": "110", "PATH": at_hand}
    done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def document(seen: Seen) -> str:
    """The page."""
    environment = Environment(
        loader=FileSystemLoader(PICTURES), undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    events = seen["before"]["events"]
    named, second = seen["candidates"]
    return environment.get_template("page.md.jinja").render(
        seen,
        fitted=[event for event in events if event["role"] == "fitted"],
        later=[event for event in events if event["role"] == "later"],
        strongest=max(events, key=lambda event: float(event["peak"])),
        named=named,
        second=second,
        now=seen["versions"][f"with {named['effect']}"],
        hardening=RUBBER,
        commands=COMMANDS,
        mm=lambda value: f"{value:.0f}",
        percent=lambda value: f"{value:.1f}",
        kilonewtons=lambda force: f"{force / 1e3:.0f}",
        cubic=lambda value: f"{value * 1e-12:.3g}".replace("-", "−"),  # kN/mm³ of N/m³
        quintic=lambda value: f"{value * 1e-18:.3g}".replace("-", "−"),
    )


def write() -> None:
    """The page, its pictures, and what was seen."""
    PICTURES.mkdir(exist_ok=True)
    with TemporaryDirectory() as folder:
        with demonstration(Path(folder)) as shown, window() as page:
            seen = walk(page, shown, PICTURES)
        seen["typed"] = typed(shown.folder)
    SEEN.write_text(json.dumps(seen, indent=1, ensure_ascii=False) + "\n", "utf-8")
    PAGE.write_text(document(seen), "utf-8")


if __name__ == "__main__":
    write()
