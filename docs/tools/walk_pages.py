"""Every page of a running service: one address of each kind, by following the links from the first page."""

import re
from collections import deque
from collections.abc import Iterator, Sequence
from urllib.parse import urljoin, urlsplit

import httpx

LINK = re.compile(r'href="([^"#]+)"')
NUMBER = re.compile(r"(?<=/)\d+(?=/|$|\.)")
NO_PAGES = ("/static/", "/api/", "/openapi.json", "/fdsnws/", "/logout")
EXAMPLES = 3
"""Pages of one kind whose links are followed: not each of them leads everywhere."""


def reader(address: str) -> httpx.Client:
    """A client for a slow walk, between whose requests the server may close a kept connection."""
    return httpx.Client(base_url=address, timeout=60.0, limits=httpx.Limits(max_keepalive_connections=0))


def pages(client: httpx.Client, starts: Sequence[str] = ("/",)) -> Iterator[tuple[str, str]]:
    """Kind and path of each page that can be reached: `/events/N` stands for the page of any event.

    Args:
        client: of the service, with a key or session.
        starts: paths to start from; the first of a kind that their links lead to is its example.
    """
    seen: dict[str, int] = {}
    waiting, known = deque(starts), set(starts)
    while waiting:
        address = waiting.popleft()
        kind = kind_of(address)
        if seen.get(kind, 0) >= EXAMPLES:
            continue
        answer = client.get(address)
        if answer.status_code != 200 or not answer.headers.get("content-type", "").startswith("text/html"):
            continue
        seen[kind] = seen.get(kind, 0) + 1
        if seen[kind] == 1:
            yield kind, address
        for link in LINK.findall(answer.text):
            further = urljoin(address, link.replace("&amp;", "&"))
            is_page = further.startswith("/") and not urlsplit(further).path.startswith(NO_PAGES)
            if is_page and further not in known:
                known.add(further)
                waiting.append(further)


def kind_of(address: str) -> str:
    """The path of an address with N in place of each number, and without the chart's or building's name."""
    path = NUMBER.sub("N", urlsplit(address).path)
    path = re.sub(r"(?<=/charts/)[^/]+(?=\.html$)", "CHART", path)
    return re.sub(r"^/(buildings|effects)/[^/]+", r"/\1/NAME", path)
