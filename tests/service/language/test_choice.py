"""The language of a page: the one chosen, otherwise the one that the browser prefers, otherwise English."""

import pytest
from api_client import client

from service.language.choice import accepted


@pytest.mark.parametrize(
    ("header", "language"),
    [
        ("", "en"),
        ("ja", "ja"),
        ("ja-JP,ja;q=0.9,en;q=0.8", "ja"),
        ("en-GB,en;q=0.9,ja;q=0.8", "en"),
        ("fr,ja;q=0.5", "ja"),
        ("fr", "en"),
        ("ja;q=0", "en"),
        ("ja;q=much,en;q=0.1", "en"),
        ("," * 10_000 + "ja", "en"),
    ],
)
def test_the_browser_s_preference_is_read(header: str, language: str) -> None:
    assert accepted(header) == language


def test_a_page_is_in_the_preferred_language_until_another_is_chosen(database_url: str) -> None:
    with client(database_url) as asking:
        page = asking.get("/login", headers={"Accept-Language": "ja"})
        assert '<html lang="ja">' in page.text
        assert page.headers["Content-Language"] == "ja"
        assert "Accept-Language" in page.headers["Vary"]
        assert 'aria-label="言語"' in page.text
        there = {"Referer": f"{asking.base_url}/login?next=%2Fkeys"}
        chosen = asking.post("/language", data={"language": "en"}, headers=there, follow_redirects=False)
        assert (chosen.status_code, chosen.headers["Location"]) == (303, "/login?next=%2Fkeys")
        page = asking.get("/login", headers={"Accept-Language": "ja"})
        assert '<html lang="en">' in page.text
        there = {"Referer": "http://else.where/login"}
        elsewhere = asking.post("/language", data={"language": "ja"}, headers=there, follow_redirects=False)
        assert elsewhere.headers["Location"] == "/"
        assert asking.post("/language", data={"language": "xx"}, follow_redirects=False).is_client_error
