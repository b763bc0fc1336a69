"""Write docs/operate/first-page.png while `menshin demo` runs.

    python docs/tools/write_first_page.py http://127.0.0.1:8000

It needs a Chromium: the system's, or that of `playwright install chromium`.
"""

from pathlib import Path
from typing import Annotated

import typer
from playwright.sync_api import FloatRect
from system_chromium import chromium

TARGET = Path(__file__).parents[1] / "operate" / "first-page.png"
WIDTH, HEIGHT = 1240, 800
"""Pixels of the window; the picture ends below the section and the years."""
MARGIN = 12
"""Pixels below them."""
PATIENCE = 300.0
"""s, for a page of a busy machine."""


def write(address: Annotated[str, typer.Argument(help="Address of the demonstration.")]) -> None:
    """Take the picture."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_default_timeout(1e3 * PATIENCE)
        page.goto(f"{address.rstrip('/')}/buildings/DEMO")
        drawings = page.locator(".sides:has(.drawing)").first.bounding_box()
        if drawings is None:
            raise typer.BadParameter(f"{address} shows no building; try again when an earthquake is analysed")
        clip = FloatRect(x=0.0, y=0.0, width=WIDTH, height=drawings["y"] + drawings["height"] + MARGIN)
        page.screenshot(path=TARGET, full_page=True, clip=clip)


if __name__ == "__main__":
    typer.run(write)
