"""How a server is asked: bounded, patient, and going on where an answer broke off."""

import logging
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from time import monotonic

import httpx

from service.settings import Settings
from service.sources.arrival import SourceError, TooLargeError
from service.version import VERSION

log = logging.getLogger(__name__)

WORTH_REPEATING = {408, 425, 429, 500, 502, 503, 504}
LONGEST_DELAY = 60.0  # s
LONGEST_ANSWER = 20  # times the timeout: an answer that comes by drops is given up


@dataclass(frozen=True, slots=True)
class Answer:
    """What a server answered, with its body whole."""

    status: int
    """200, 204 and 404 (there is nothing), 304 (nothing has changed)."""
    body: bytes
    etag: str | None
    """A mark of this version."""
    modified: str | None
    """When it was changed last, as the server says it."""

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing, or nothing new."""
        return self.status != HTTPStatus.OK


@dataclass(slots=True)
class Partial:
    """The beginning of an answer that broke off."""

    body: bytearray = field(default_factory=bytearray)
    mark: str | None = None
    """What the server must still have for the rest to fit."""


class BrokenError(SourceError):
    """An attempt that may go better the next time."""

    def __init__(self, message: str, after: float | None = None) -> None:
        super().__init__(message)
        self.after = after


@dataclass(frozen=True, slots=True)
class Client:
    """Asks servers, as the settings say."""

    http: httpx.Client
    settings: Settings
    sleep: Callable[[float], object]
    """Waits so many seconds."""

    def get(self, address: str, parameters: Mapping[str, str] | None = None, etag: str | None = None) -> Answer:
        """The answer to a question, asked again while that may help.

        Args:
            address: absolute.
            parameters: of the query.
            etag: of the version that is had already.

        Raises:
            TooLargeError: it has more bytes than are accepted; its body is not read.
            SourceError: no answer after all attempts, or a refusal.
        """
        url = httpx.URL(address, params=parameters) if parameters else httpx.URL(address)
        partial = Partial()
        for attempt in range(self.settings.http_retries + 1):
            try:
                return self._attempt(url, etag, partial)
            except BrokenError as error:
                if attempt == self.settings.http_retries:
                    raise SourceError(f"{error}, {attempt + 1} times; it is tried again at the next look") from error
                self.sleep(self._delay(attempt, error.after))
        raise AssertionError("unreachable")

    def _delay(self, attempt: int, wanted: float | None) -> float:
        """s; ever longer, and scattered, so that many clients do not come back together."""
        delay: float = self.settings.retry_delay * 2.0**attempt * random.uniform(0.5, 1.5)
        return min(max(delay, wanted or 0.0), LONGEST_DELAY)

    def _attempt(self, url: httpx.URL, etag: str | None, partial: Partial) -> Answer:
        headers = {"If-None-Match": etag} if etag else {}
        if partial.body and partial.mark:
            headers = {"Range": f"bytes={len(partial.body)}-", "If-Range": partial.mark}
        try:
            with self.http.stream("GET", url, headers=headers) as response:
                return self._answer(response, partial)
        except httpx.TimeoutException as error:
            raise BrokenError(f"{url} did not answer within {self.settings.http_timeout:g} s") from error
        except httpx.TransportError as error:
            raise BrokenError(f"{url} cannot be reached, or broke off: {error}") from error
        except httpx.HTTPError as error:
            raise SourceError(f"{url} cannot be asked: {error}; correct location in the building file") from error

    def _answer(self, response: httpx.Response, partial: Partial) -> Answer:
        status = response.status_code
        etag, modified = response.headers.get("etag"), response.headers.get("last-modified")
        if status in (HTTPStatus.NO_CONTENT, HTTPStatus.NOT_FOUND, HTTPStatus.NOT_MODIFIED):
            return Answer(status, b"", etag, modified)
        if status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
            raise TooLargeError(str(response.url), None, self.settings.max_answer_bytes)
        if status in WORTH_REPEATING:
            after = response.headers.get("retry-after", "")
            raise BrokenError(
                f"{response.url} answered {status} {response.reason_phrase}", float(after) if after.isdigit() else None
            )
        if status not in (HTTPStatus.OK, HTTPStatus.PARTIAL_CONTENT):
            raise SourceError(
                f"{response.url} answered {status} {response.reason_phrase}; correct the source in the building file"
            )
        if status == HTTPStatus.OK or not response.headers.get("content-range", "").startswith(
            f"bytes {len(partial.body)}-"
        ):
            partial.body.clear()
        partial.mark = modified if etag is None or etag.startswith("W/") else etag
        self._read(response, partial.body)
        return Answer(HTTPStatus.OK, bytes(partial.body), etag, modified)

    def _read(self, response: httpx.Response, body: bytearray) -> None:
        limit, began = self.settings.max_answer_bytes, monotonic()
        promised = int(response.headers.get("content-length") or 0) + len(body)
        if promised > limit:
            raise TooLargeError(str(response.url), promised, limit)
        for piece in response.iter_raw():
            body.extend(piece)
            if len(body) > limit:
                raise TooLargeError(str(response.url), None, limit)
            if monotonic() - began > LONGEST_ANSWER * self.settings.http_timeout:
                raise BrokenError(f"{response.url} sent only {len(body)} bytes in {monotonic() - began:.0f} s")


def client(settings: Settings, sleep: Callable[[float], object]) -> Client:
    """A client for one source; close its `http` afterwards."""
    http = httpx.Client(
        timeout=httpx.Timeout(settings.http_timeout),
        limits=httpx.Limits(max_connections=settings.source_concurrency),
        headers={"User-Agent": f"menshin/{VERSION}", "Accept-Encoding": "identity"},
        follow_redirects=True,
    )
    return Client(http, settings, sleep)
