"""Write docs/operate/first-page.png while `menshin demo` runs.

    python docs/tools/write_first_page.py http://127.0.0.1:8000

It needs a Chromium: the system's, or that of `playwright install chromium`.
"""

from io import BytesIO
from pathlib import Path
from typing import Annotated

import typer
from PIL import Image
from playwright.sync_api import FloatRect, Page
from system_chromium import chromium

TARGET = Path(__file__).parents[1] / "operate" / "first-page.png"
WIDTH, HEIGHT = 1240, 800
"""Pixels of the window; the picture has the top of the page, and below it the section and the years."""
MARGIN = 12
"""Pixels below each part."""
PATIENCE = 300.0
"""s, for a page of a busy machine."""


def write(address: Annotated[str, typer.Argument(help="Address of the demonstration.")]) -> None:
    """Take the picture."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_default_timeout(1e3 * PATIENCE)
        page.goto(f"{address.rstrip('/')}/buildings/DEMO")
        top = page.get_by_role("region", name="In short").bounding_box()
        drawings = page.locator(".sides:has(.drawing)").first.bounding_box()
        if top is None or drawings is None:
            raise typer.BadParameter(f"{address} shows no building; try again when an earthquake is analysed")
        spans = (0.0, top["y"] + top["height"]), (drawings["y"], drawings["y"] + drawings["height"])
        parts = [Image.open(BytesIO(_between(page, *span))) for span in spans]
    picture = Image.new("RGB", (WIDTH, sum(part.height for part in parts)), "white")
    at = 0
    for part in parts:
        picture.paste(part, (0, at))
        at += part.height
    picture.save(TARGET)


def _between(page: Page, begin: float, end: float) -> bytes:
    """PNG of the page between two heights, in pixels."""
    clip = FloatRect(x=0.0, y=begin, width=WIDTH, height=end + MARGIN - begin)
    return page.screenshot(full_page=True, clip=clip)


if __name__ == "__main__":
    typer.run(write)
