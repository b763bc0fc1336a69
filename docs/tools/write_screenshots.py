"""Write docs/operate/pages.md with a picture of every page, from demonstrations that run.

    python docs/tools/write_screenshots.py http://127.0.0.1:8000 [http://127.0.0.1:8001 ...] --key KEY [--key KEY ...]

Each picture shows the light theme, the dark one, and a telephone. A page that several demonstrations have is taken from
the first. The keys are those of administrators, one for each demonstration in the same order. It needs a Chromium: the
system's, or that of `playwright install chromium`.
"""

import re
import shutil
from io import BytesIO
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image
from playwright.sync_api import Browser, Page
from system_chromium import chromium
from walk_pages import pages, reader

HERE = Path(__file__).parents[1] / "operate"
TARGET, PICTURES = HERE / "pages.md", HERE / "pages"
DESKTOP, TELEPHONE = (1280, 1600), (375, 812)
"""Pixels of the windows, across and down."""
SHARE = 0.5
"""Size of a desktop's window in a picture, as a share of its own."""
QUALITY = 60
GAP = 16
"""Pixels between the windows."""
PATIENCE = 120.0
"""s, for a page of a busy machine."""
ENTRY = re.compile(r"## `(.+)`\n\n!\[(.+)\]\(")
"""Kind and title of a page in the document."""
OPENING = """\
# Every page

Each picture shows a page of the demonstrations in the light theme, in the dark one, and on a telephone. Written by

    menshin demo --hidden-effect --port 8000
    menshin demo --stiffness-loss --port 8001
    python docs/tools/write_screenshots.py http://127.0.0.1:8000 http://127.0.0.1:8001 --key KEY --key KEY

after the diagnosis of [the tutorial](../models/tutorial.md), a forecast and *One more sensor*; the keys are those of
administrators, which `menshin key create` made for the database of each demonstration. Long pages are cut.
`--only /sensors/N` takes one kind again.
"""


def write(
    addresses: Annotated[list[str], typer.Argument(help="Addresses of the demonstrations.")],
    key: Annotated[list[str], typer.Option(help="Key of an administrator of each, in the same order.")],
    only: Annotated[list[str] | None, typer.Option(help="A kind of page, such as /sensors/N; the others stay.")] = None,
) -> None:
    """Take the pictures, and write the page."""
    titles: dict[str, str] = {}
    if only is None:
        shutil.rmtree(PICTURES, ignore_errors=True)
        PICTURES.mkdir()
    else:
        titles = {kind: title for kind, title in ENTRY.findall(TARGET.read_text("utf-8")) if kind not in only}
    with chromium() as browser:
        for address, secret in zip(addresses, key, strict=True):
            headers = {"Authorization": f"Bearer {secret}"}
            with reader(address) as client:
                client.headers.update(headers)
                for kind, path in pages(client, ("/", "/login")):
                    if kind not in titles and (only is None or kind in only):
                        file = PICTURES / f"{name(kind)}.webp"
                        titles[kind] = take(browser, f"{address}{path}", headers, file)
    parts = [f"## `{kind}`\n\n![{titles[kind]}](pages/{name(kind)}.webp)\n" for kind in sorted(titles)]
    TARGET.write_text("\n".join([OPENING, *parts]), "utf-8")


def name(kind: str) -> str:
    """Name of a page's picture."""
    return re.sub(r"\W+", "-", kind).strip("-") or "home"


def take(browser: Browser, address: str, headers: dict[str, str], file: Path) -> str:
    """Write a page's picture; its title."""
    shown = [(DESKTOP, "light"), (DESKTOP, "dark"), (TELEPHONE, "light")]
    windows = []
    for (width, height), theme in shown:
        page = browser.new_page(
            viewport={"width": width, "height": height},
            color_scheme=theme,  # type: ignore[arg-type]
            extra_http_headers=headers,
        )
        page.set_default_timeout(1e3 * PATIENCE)
        page.goto(address)
        page.wait_for_load_state("networkidle")
        title = page.title()
        windows.append(window(page))
        page.close()
    sizes = [one.resize((round(one.width * SHARE), round(one.height * SHARE))) for one in windows[:2]]
    beside(*sizes, windows[2]).save(file, quality=QUALITY)
    return title


def window(page: Page) -> Image.Image:
    """The contents of the browser's window."""
    return Image.open(BytesIO(page.screenshot())).convert("RGB")


def beside(*images: Image.Image) -> Image.Image:
    """Images in one row, on grey."""
    across = sum(one.width for one in images) + GAP * (len(images) - 1)
    whole = Image.new("RGB", (across, max(one.height for one in images)), "#808890")
    left = 0
    for one in images:
        whole.paste(one, (left, 0))
        left += one.width + GAP
    return whole


if __name__ == "__main__":
    typer.run(write)
