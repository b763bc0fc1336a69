"""The API for people: Swagger UI sends requests with the browser's session, and without JavaScript there is a text."""

import pytest
from accessible import problems
from api_server import api_server
from browsers import needs_chromium
from system_chromium import chromium

from service.http.api_page import with_code
from service.http.libraries import address

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

PATIENCE = 120_000.0
"""ms; Swagger UI draws 92 operations in 10 s on a quiet machine."""


@needs_chromium
def test_an_operation_can_be_tried_and_read_without_javascript(url: str) -> None:
    with api_server(url) as server, chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE)
        printed: list[str] = []
        page.on("console", lambda message: printed.append(message.text) if message.type == "error" else None)
        page.goto(f"{server}/docs#/buildings/list_buildings")
        page.get_by_role("button", name="Try it out").click()
        page.get_by_role("button", name="Execute").click()
        assert "200" in page.locator(".live-responses-table tbody .response-col_status").first.inner_text()
        assert '"items": []' in page.locator(".live-responses-table .microlight").first.inner_text()
        page.locator(".opblock.is-open .opblock-summary-control").click()  # opened, axe blames Swagger UI's own form
        assert not page.locator("#reference").is_visible()
        assert problems(page) == []
        assert printed == [], "the browser refused something"

        still = browser.new_context(java_script_enabled=False).new_page()
        still.goto(f"{server}/docs#list_buildings")
        assert still.get_by_role("link", name="GET /api/v1/buildings", exact=True).is_visible()
        assert "`" not in still.inner_text("#reference")
        documented = still.request.get(f"{server}/openapi.json").json()["paths"]
        assert still.locator("#reference section").count() == sum(map(len, documented.values()))
        for ending in ("js", "css"):
            assert still.request.get(f"{server}{address('swagger-ui', ending)}").ok


def test_markup_in_a_description_stays_text() -> None:
    assert with_code("`a` <b>") == "<code>a</code> &lt;b&gt;"
