"""The listings of a server, page by page; one that did not change since all its files were taken is not read again."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import timedelta
from http import HTTPStatus
from typing import Any

from service.records.sources.arrival import SourceError
from service.records.sources.http import Answer, Client
from service.records.sources.listing import Listed, listed
from service.records.sources.unreachable import refusal

DEEPEST = 4
"""Folders below the first: an archive by year, month and day."""
ONE_SECOND = timedelta(seconds=1)
"""Times of HTTP tell no less: a page younger than that may have changed again unnoticed (RFC 9110, 8.8.2.2)."""


@dataclass(frozen=True, slots=True)
class Page:
    """One listing."""

    address: str
    files: tuple[Listed, ...]
    folders: tuple[str, ...]
    unless: Mapping[str, str]
    """Headers that ask for it only if it has changed; empty if the server gives nothing to tell that by."""


def pages(client: Client, address: str, had: Mapping[str, Any], depth: int = 0) -> Iterator[Page]:
    """The listing at an address and those below it.

    Args:
        client: that asks.
        address: of the listing.
        had: what was remembered of earlier looks.
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


def remembered(found: Collection[Page], unread: Collection[str]) -> dict[str, Any]:
    """What to remember of the pages: those that can be asked for by their version and of which all was read.

    Args:
        found: the pages.
        unread: addresses of files, or of whole pages, that are wanted at the next look.
    """
    return {
        page.address: {"unless": dict(page.unless), "folders": list(page.folders)}
        for page in found
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
