"""Listings of a server: HTML directory pages, JSON lists or lines of text, with the folders below them.

A listing that did not change since all its files were fetched is not read again.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import timedelta
from html.parser import HTMLParser
from http import HTTPStatus
from typing import Any
from urllib.parse import urljoin, urlsplit

from service.records.sources.problems import refusal
from service.records.sources.retried_requests import Answer, Client
from service.records.sources.source import SourceError

LARGEST = 16 * 2**20
"""Bytes of a listing."""
LONGEST_MARK = 1000
"""Characters."""
DEEPEST = 4
"""Levels of folders below the first: an archive by year, month and day."""
ONE_SECOND = timedelta(seconds=1)
"""Resolution of HTTP's times: a younger page may have changed again unnoticed (RFC 9110, 8.8.2.2)."""


@dataclass(frozen=True, slots=True)
class Listed:
    """A file, or a folder where the address ends with a slash."""

    address: str
    """Absolute."""
    mark: str
    """Time and size as the listing prints them: another mark means another version."""


@dataclass(frozen=True, slots=True)
class Page:
    """One listing."""

    address: str
    files: tuple[Listed, ...]
    folders: tuple[str, ...]
    unless: Mapping[str, str]
    """Headers for a conditional request; empty if the server supports none."""


def pages(client: Client, address: str, had: Mapping[str, Any], depth: int = 0) -> Iterator[Page]:
    """The listing at an address and those below it.

    Args:
        client: of the server.
        address: of the listing.
        had: result of `remembered` at an earlier poll.
        depth: below the first.

    Raises:
        SourceError: one of them could not be read.
    """
    known = had.get(address, {"unless": {}, "folders": []})
    answer = client.get(address, unless=known["unless"])
    if answer.status == HTTPStatus.NOT_FOUND and depth == 0:
        raise SourceError(f"{address} {refusal(answer.status, 'Not Found')}")
    if answer.status == HTTPStatus.NOT_MODIFIED:
        page = Page(address, (), tuple(known["folders"]), known["unless"])
    else:
        entries = () if answer.is_empty else listed(address, answer.body)
        files = tuple(entry for entry in entries if not entry.address.endswith("/"))
        folders = tuple(entry.address for entry in entries if entry.address.endswith("/"))
        page = Page(address, files, folders, _unless(answer))
    yield page
    for folder in page.folders if depth < DEEPEST else ():
        yield from pages(client, folder, had, depth + 1)


def remembered(pages: Collection[Page], unread: Collection[str]) -> dict[str, Any]:
    """The pages to skip while unchanged: those that support conditional requests and were read completely.

    Args:
        pages: of this poll.
        unread: addresses of files, or of whole pages, that are needed at the next poll.
    """
    return {
        page.address: {"unless": dict(page.unless), "folders": list(page.folders)}
        for page in pages
        if page.unless and not {page.address, *(file.address for file in page.files)} & set(unread)
    }


def _unless(answer: Answer) -> dict[str, str]:
    if not answer.is_delimited or answer.is_empty:
        return {}
    if answer.etag is not None:
        return {"If-None-Match": answer.etag}
    if answer.modified is not None and answer.age is not None and answer.age > ONE_SECOND:
        return {"If-Modified-Since": answer.modified}
    return {}


def listed(address: str, body: bytes) -> tuple[Listed, ...]:
    """The entries below the listing's own address, in its order, each once.

    Raises:
        SourceError: the body is no listing.
    """
    if len(body) > LARGEST:
        raise SourceError(f"{address} lists files in {len(body)} bytes, {LARGEST} are accepted; list fewer at a time")
    text = body.decode("utf-8", errors="replace").strip()
    if text.startswith(("[", "{")):
        entries = _json(address, text)
    elif text.startswith("<"):
        entries = _html(text)
    else:
        entries = [(line.strip(), "") for line in text.splitlines() if line.strip() and not line.startswith("#")]
    folder = address if address.endswith("/") else address.rsplit("/", 1)[0] + "/"
    below = (Listed(_absolute(address, name), mark) for name, mark in entries if name[:1] not in "?#")
    unique = {entry.address: entry for entry in below if _is_below(entry.address, folder)}
    return tuple(unique.values())


def _absolute(address: str, name: str) -> str:
    """The address of an entry; empty, and so below no folder, where its name is invalid."""
    try:
        return urljoin(address, name)
    except ValueError:
        return ""


def _is_below(address: str, folder: str) -> bool:
    return address.startswith(folder) and address != folder and ".." not in urlsplit(address).path


def _json(address: str, text: str) -> list[tuple[str, str]]:
    try:
        document = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise SourceError(f"{address} is not JSON: {error}; serve a list of file names") from error
    rows = document.get("files") if isinstance(document, dict) else document
    if not isinstance(rows, list):
        raise SourceError(f'{address} is not an index of files; serve ["a.mseed", ...] or {{"files": [...]}}')
    entries = []
    for row in rows:
        name = row if isinstance(row, str) else next((row[k] for k in ("url", "href", "name") if k in row), None)
        if not isinstance(name, str):
            raise SourceError(
                f"{address} lists a {type(row).__name__} without a name; list names, or objects with a name"
            )
        entries.append((name, "" if isinstance(row, str) else json.dumps(row, sort_keys=True)))
    return entries


def _html(text: str) -> list[tuple[str, str]]:
    parser = Links()
    parser.feed(text)
    return [(name, " ".join(mark.split())) for name, mark in parser.links]


class Links(HTMLParser):
    """Every link of a page with the text that follows it."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[tuple[str, str]] = []
        self._within = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """A link begins."""
        target = dict(attrs).get("href") if tag == "a" else None
        if target:
            self.links.append((target, ""))
            self._within = True

    def handle_endtag(self, tag: str) -> None:
        """A link's own text ends."""
        if tag == "a":
            self._within = False

    def handle_data(self, data: str) -> None:
        """Text beside a link is its mark."""
        if self.links and not self._within:
            name, mark = self.links[-1]
            self.links[-1] = (name, (mark + data)[:LONGEST_MARK])
