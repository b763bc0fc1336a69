"""An HTTP server that lists files of events: a directory page, or an index in JSON or text."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime, timedelta
from email.utils import parsedate_to_datetime
from urllib.parse import unquote

from service.sources.arrival import Arrival, Cursor, SourceError, Step, TooLargeError
from service.sources.http import Answer, Client
from service.sources.listing import Listed, listed

DEEPEST = 4
"""Folders below the first: an archive by year, month and day."""


@dataclass(frozen=True, slots=True)
class Archive:
    """Every file that the server lists, fetched once, and again when the listing marks it as changed."""

    address: str
    client: Client

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """New and changed files; one that still grows is left for the next look."""
        taken: dict[str, str] = dict(cursor.get("taken", {}))
        seen: dict[str, str] = dict(cursor.get("seen", {}))
        wanted = [entry for entry in self._entries(self.address) if taken.get(entry.address) != entry.mark]
        pages: list[str] = []
        count = self.client.settings.source_concurrency
        with ThreadPoolExecutor(count) as pool:
            for first in range(0, len(wanted), count):  # so many at a time: they are held in memory
                batch = wanted[first : first + count]
                arrivals = []
                for entry, arrival in zip(batch, pool.map(lambda e: self._arrival(e, now), batch), strict=True):
                    if arrival is None or seen.get(entry.address, entry.mark) != entry.mark:
                        seen[entry.address] = entry.mark
                        continue
                    if is_page(arrival):
                        pages.append(entry.address)
                        arrivals.append(arrival)
                        continue
                    taken[entry.address] = entry.mark
                    seen.pop(entry.address, None)
                    arrivals.append(arrival)
                yield Step(tuple(arrivals), {"taken": dict(taken), "seen": dict(seen)})

        if pages:
            raise SourceError(f"{pages[0]} answered with an HTML page in place of a file; it is asked for again")

    def _entries(self, address: str, depth: int = 0) -> Iterator[Listed]:
        answer = self.client.get(address)
        for entry in () if answer.is_empty else listed(address, answer.body):
            if not entry.address.endswith("/"):
                yield entry
            elif depth < DEEPEST:
                yield from self._entries(entry.address, depth + 1)

    def _arrival(self, entry: Listed, now: datetime) -> Arrival | None:
        """The file; None if it is gone or still grows."""
        name = unquote(entry.address.rsplit("/", 1)[1])
        try:
            answer = self.client.get(entry.address)
        except TooLargeError as error:
            return Arrival(name=name, origin=entry.address, data=None, refusal=str(error))
        if answer.is_empty or self._is_young(answer, now):
            return None
        return Arrival(name=name, origin=entry.address, data=answer.body)

    def _is_young(self, answer: Answer, now: datetime) -> bool:
        if answer.modified is None:
            return False
        try:
            changed = parsedate_to_datetime(answer.modified)
        except ValueError:
            return False
        settle_time = timedelta(seconds=self.client.settings.settle_time)
        return changed.tzinfo is not None and timedelta(0) <= now - changed < settle_time


def is_page(arrival: Arrival) -> bool:
    """Whether a server that wants a login, or is being mended, has answered in place of the file."""
    return arrival.data is not None and arrival.data[:256].lstrip().lower().startswith((b"<!doctype html", b"<html"))
