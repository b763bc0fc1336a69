"""A browser for tests."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser
from system_chromium import PROGRAM

needs_chromium = pytest.mark.skipif(PROGRAM is None, reason="Debian's chromium-headless-shell is not installed")


@contextmanager
def closing_pages(browser: Browser) -> Iterator[Browser]:
    """For one test, whose pages and cookies are gone afterwards."""
    yield browser
    for context in browser.contexts:
        context.close()
