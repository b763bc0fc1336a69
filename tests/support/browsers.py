"""A browser for the tests of a module: its start takes 2 s of processor time."""

from collections.abc import Iterator
from contextlib import contextmanager
from shutil import which

from playwright.sync_api import Browser, sync_playwright


@contextmanager
def chromium() -> Iterator[Browser]:
    """The system's Chromium."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=which("chromium"))
        yield browser
        browser.close()


@contextmanager
def closing_pages(browser: Browser) -> Iterator[Browser]:
    """For one test, whose pages and cookies are gone afterwards."""
    yield browser
    for context in browser.contexts:
        context.close()
