"""Accessibility of a page in a browser: axe's rules in both themes, and no sideways scrolling."""

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

THEMES = "light", "dark"
WIDTHS = 375, 320
"""Pixels of telephones."""
HEIGHT = 800


ONLY_COLOURS = {"runOnly": ["color-contrast"], "resultTypes": ["violations"]}
"""Rules whose result a second theme may change."""

AT_REST = """Promise.all(
    document.getAnimations()
        .filter(one => one.effect.getComputedTiming().endTime !== Infinity)
        .map(one => one.finished.catch(() => null))
).then(() => null)"""
"""Waits until colours have arrived at those of the theme; what never ends is left alone."""


def problems(page: Page) -> list[str]:
    """Findings on the page that the browser has just opened, in the light theme; it stays dark, and narrow."""
    found = []
    for theme in THEMES:
        if theme != THEMES[0]:
            page.evaluate(
                "theme => { document.documentElement.dataset.theme = theme;"
                " document.dispatchEvent(new Event('themechange')); }",
                theme,
            )
        page.wait_for_timeout(100)  # charts are drawn, and drawn again
        page.evaluate(AT_REST)
        options = {"resultTypes": ["violations"]} if theme == THEMES[0] else ONLY_COLOURS
        for rule in Axe().run(page, options=options).response["violations"]:
            places = "; ".join(node["html"][:100] for node in rule["nodes"][:3])
            found.append(f"{theme}: {rule['id']} at {len(rule['nodes'])} places: {places}")
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": HEIGHT})
        page.wait_for_timeout(100)
        needed = page.evaluate("document.documentElement.scrollWidth")
        if needed > width:
            found.append(f"{needed} pixels wide on a screen of {width}")
    return found
