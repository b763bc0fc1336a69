"""The system's Chromium, as the documentation's scripts and the tests start it."""

from collections.abc import Iterator
from contextlib import contextmanager
from shutil import which

from playwright.sync_api import Browser, sync_playwright

PROGRAM = which("chromium-headless-shell") or which("chromium") or which("google-chrome")
"""Preferably the one without a user interface, which starts in a third of the processor time. None: what
`playwright install chromium` brought."""


@contextmanager
def chromium() -> Iterator[Browser]:
    """A browser that ends with the context."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=PROGRAM)
        try:
            yield browser
        finally:
            browser.close()
