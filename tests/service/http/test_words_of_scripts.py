"""Scripts have their words from the page, in its language."""

import html
import json
import re
from pathlib import Path

import pytest
from api_client import client

from service.http import rendering

ASKED = re.compile(r'inWords\("([^"]*)"\)')
SCRIPTS = Path(rendering.__file__).parent / "static"

pytestmark = pytest.mark.sqlite


def test_a_page_has_every_word_that_its_scripts_ask_for(database_url: str) -> None:
    asked = {text for script in SCRIPTS.glob("*.js") for text in ASKED.findall(script.read_text("utf-8"))}
    assert {"Reset zoom", "Dark theme"} <= asked
    with client(database_url) as api:
        page = api.get("/login", params={"language": "ja"}).text
        assert "data-words" not in api.get("/login").text
    found = re.search(r'data-words="([^"]*)"', page)
    assert found is not None
    words = json.loads(html.unescape(found[1]))
    assert set(words) == asked
    assert all(text != english for english, text in words.items())
