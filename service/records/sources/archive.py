"""An HTTP server that lists files of events, on directory pages or in an index in JSON or text."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime, timedelta
from email.utils import parsedate_to_datetime
from multiprocessing.pool import ThreadPool
from urllib.parse import unquote

from service import parsing
from service.addresses import without_credentials
from service.records.sources.listing import Listed, Page, pages, remembered
from service.records.sources.problems import incomplete, is_page, titled
from service.records.sources.retried_requests import Answer, Client, Partial, UnansweredError
from service.records.sources.source import (
    Arrival,
    Cursor,
    Known,
    Memory,
    SourceError,
    Step,
    TooLargeError,
    in_batches,
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of one request for a file."""

    arrival: Arrival | None = None
    known: Known | None = None
    """New state of the file; None where it did not change."""
    grows: bool = False
    """True if the file is left for the next poll."""
    error: SourceError | None = None
    """Reason for the new request."""


@dataclass(frozen=True, slots=True)
class Archive:
    """Every file that the server lists, fetched once, and again when its mark in the listing changes."""

    address: str
    client: Client
    memory: Memory

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """New and changed files; one that is still growing, or cannot be fetched, is left for the next poll.

        Raises:
            SourceError: for the first file that could not be fetched, after all others; at once if the server is away.
        """
        listings = list(pages(self.client, self.address, cursor.get("listings", {})))
        seen: dict[str, str] = cursor.get("seen", {})
        growing: dict[str, str] = {}
        errors: list[SourceError] = []
        with ExitStack() as stack:
            pool: ThreadPool | None = None  # where at most one file is new, no thread is started
            for batch in self._wanted(listings):
                if len(batch) == 1:
                    outcomes = [self._outcome(*batch[0], seen, now)]
                else:
                    if pool is None:  # its threads never delay the end
                        pool = stack.enter_context(ThreadPool(self.client.settings.polling.concurrency))
                    outcomes = pool.map(lambda wanted: self._outcome(*wanted, seen, now), batch)
                growing |= {e.address: e.mark for (e, _), out in zip(batch, outcomes, strict=True) if out.grows}
                errors += [out.error for out in outcomes if out.error is not None]
                yield Step(
                    tuple(out.arrival for out in outcomes if out.arrival is not None),
                    cursor,
                    tuple(out.known for out in outcomes if out.known is not None),
                )
                if all(isinstance(out.error, UnansweredError) for out in outcomes):
                    break
        unread = growing.keys() | ({page.address for page in listings} if errors else set())
        yield Step((), {"seen": growing, "listings": remembered(listings, unread)})
        if errors:
            raise errors[0]

    def _wanted(self, listings: Sequence[Page]) -> Iterator[Sequence[tuple[Listed, Known]]]:
        """New and changed files, as many at a time as fit into memory."""
        count = self.client.settings.polling.concurrency
        files = [file for page in listings for file in page.files]
        for batch in in_batches(files):
            had = self.memory.known([file.address for file in batch])
            pairs = [(file, had.get(file.address, Known(file.address))) for file in batch]
            wanted = [(file, known) for file, known in pairs if known.mark != file.mark]
            yield from (wanted[first : first + count] for first in range(0, len(wanted), count))

    def _outcome(self, entry: Listed, known: Known, seen: dict[str, str], now: datetime) -> Outcome:
        name = unquote(without_credentials(entry.address).rsplit("/", 1)[1])
        fetched = Known(entry.address, entry.mark)
        try:
            answer = self.client.get(entry.address, partial=self._partial(known))
        except TooLargeError as error:
            return Outcome(Arrival(name=name, origin=entry.address, data=None, refusal=str(error)), fetched)
        except UnansweredError as error:
            return Outcome(known=_begun(known, error.partial), error=error)
        except SourceError as error:
            return Outcome(error=error)
        if answer.is_empty or seen.get(entry.address, entry.mark) != entry.mark or self._is_young(answer, now):
            return Outcome(grows=True)
        arrival = Arrival(name=name, origin=entry.address, data=answer.body)
        if is_page(answer.body):
            reason = f"{entry.address} answered with {titled(answer.body)} in place of a file; it is requested again"
            return Outcome(arrival, Known(entry.address, known.mark), error=SourceError(reason))
        is_last = known.attempts + 1 >= self.client.settings.jobs.attempts
        if not is_last and (defect := self._incomplete(name, answer)) is not None:
            reason = f"{entry.address} may have broken off ({defect}); it is requested again"
            return Outcome(arrival, Known(entry.address, known.mark, known.attempts + 1), error=SourceError(reason))
        return Outcome(arrival, fetched)

    def _partial(self, known: Known) -> Partial | None:
        if known.version is None:
            return None
        return Partial(bytearray(self.memory.beginning(known.address)), known.version)

    def _incomplete(self, name: str, answer: Answer) -> str | None:
        """Reason why a body without a stated end seems incomplete."""
        return None if answer.is_delimited else incomplete(name, answer.body, parsing.limits(self.client.settings))

    def _is_young(self, answer: Answer, now: datetime) -> bool:
        if answer.modified is None:
            return False
        try:
            changed = parsedate_to_datetime(answer.modified)
        except ValueError:
            return False
        settle_time = timedelta(seconds=self.client.settings.polling.settle_time)
        return changed.tzinfo is not None and timedelta(0) <= now - changed < settle_time


def _begun(known: Known, partial: Partial) -> Known | None:
    """A body that broke off and can be resumed."""
    if not partial.body or partial.version is None:
        return None
    return Known(known.address, known.mark, known.attempts, partial.version, bytes(partial.body))
