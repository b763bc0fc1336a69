"""Which files a server lists: an HTML directory page, a JSON list, or lines of text."""

import json
from dataclasses import dataclass
from html.parser import HTMLParser
from urllib.parse import urljoin, urlsplit

from service.records.sources.arrival import SourceError

LARGEST = 16 * 2**20
"""Bytes of a listing."""
LONGEST_MARK = 1000
"""Characters."""


@dataclass(frozen=True, slots=True)
class Listed:
    """A file, or a folder where the address ends with a slash."""

    address: str
    """Absolute."""
    mark: str
    """What the listing says beside it (time, size): another mark is another version."""


def listed(address: str, body: bytes) -> tuple[Listed, ...]:
    """The entries below the listing's own address, in its order, each once.

    Raises:
        SourceError: this is no listing.
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
    """The address of an entry; empty, and thus nowhere below, where its name makes none."""
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
        raise SourceError(f"{address} is no JSON: {error}; a list of file names would do") from error
    rows = document.get("files") if isinstance(document, dict) else document
    if not isinstance(rows, list):
        raise SourceError(f'{address} is no index of files; ["a.mseed", ...] or {{"files": [...]}} would do')
    entries = []
    for row in rows:
        name = row if isinstance(row, str) else next((row[k] for k in ("url", "href", "name") if k in row), None)
        if not isinstance(name, str):
            raise SourceError(
                f"{address} lists a {type(row).__name__} without a name; a name, or an object with a name, would do"
            )
        entries.append((name, "" if isinstance(row, str) else json.dumps(row, sort_keys=True)))
    return entries


def _html(text: str) -> list[tuple[str, str]]:
    parser = Links()
    parser.feed(text)
    return [(name, " ".join(mark.split())) for name, mark in parser.found]


class Links(HTMLParser):
    """Every link of a page with the text that follows it."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, str]] = []
        self._within = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """A link begins."""
        target = dict(attrs).get("href") if tag == "a" else None
        if target:
            self.found.append((target, ""))
            self._within = True

    def handle_endtag(self, tag: str) -> None:
        """A link's own text ends."""
        if tag == "a":
            self._within = False

    def handle_data(self, data: str) -> None:
        """Text beside a link is its mark."""
        if self.found and not self._within:
            name, mark = self.found[-1]
            self.found[-1] = (name, (mark + data)[:LONGEST_MARK])
