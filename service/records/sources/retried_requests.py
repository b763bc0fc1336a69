"""Requests to a monitoring server: bounded, repeated with patience, and resumed where an answer broke off."""

import logging
import random
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from email.utils import parsedate_to_datetime
from http import HTTPStatus
from itertools import count
from time import monotonic

import httpx

from service.records.sources.problems import LOCATION, refusal, unreachable
from service.records.sources.source import SourceError, TooLargeError
from service.settings import Settings
from service.tls import tls_context
from service.version import VERSION

log = logging.getLogger(__name__)

WORTH_REPEATING = {408, 425, 429, 500, 502, 503, 504}
LONGEST_DELAY = 60.0  # s
MOST_REDIRECTS = 5
"""Most redirects of one request. Not tuned."""
LONGEST_ANSWER = 20  # times the timeout: an answer that comes by drops is given up
AGAIN = "it is tried again at the next poll"


@dataclass(frozen=True, slots=True)
class Answer:
    """A server's answer with its complete body."""

    status: int
    """200, 204 and 404 (nothing there), or 304 (unchanged)."""
    body: bytes
    etag: str | None
    """Mark of this version."""
    modified: str | None
    """Time of the last change, as the server writes it."""
    is_delimited: bool = True
    """False if the server did not state where the body ends: then half a body looks like a whole one."""
    age: timedelta | None = None
    """Time since the last change, by the server's own clock."""

    @property
    def is_empty(self) -> bool:
        """True if there is nothing, or nothing new."""
        return self.status != HTTPStatus.OK


@dataclass(slots=True)
class Partial:
    """The beginning of an answer that broke off."""

    body: bytearray = field(default_factory=bytearray)
    version: str | None = None
    """Version that the server must still have for the rest to fit."""


class UnansweredError(SourceError):
    """No answer after all attempts."""

    def __init__(self, message: str, partial: Partial) -> None:
        super().__init__(message)
        self.partial = partial
        """The part that came; the next poll may resume after it."""


class BrokenError(SourceError):
    """A failed attempt that is worth repeating."""

    def __init__(self, message: str, after: float | None = None, helps: str = AGAIN) -> None:
        super().__init__(message)
        self.after = after
        self.helps = helps


@dataclass(frozen=True, slots=True)
class Manners:
    """Time limits of one poll of a source."""

    sleep: Callable[[float], object]
    """Waits so many seconds; True if no other attempt may follow."""
    retries: int
    """Number of times that a failed request is repeated."""
    until: float
    """s of the monotonic clock, after which no request is repeated and no step begins."""

    @property
    def is_over(self) -> bool:
        """True if the poll has used up its time."""
        return monotonic() > self.until


@dataclass(frozen=True, slots=True)
class Client:
    """Requests to a server, as bounded by the settings."""

    http: httpx.Client
    settings: Settings
    manners: Manners
    logins: Mapping[httpx.URL, httpx.BasicAuth] = field(default_factory=dict, repr=False)
    """By origin. Addresses carry no password, because they are stored and shown."""

    def get(
        self,
        address: str,
        parameters: Mapping[str, str] | None = None,
        *,
        unless: Mapping[str, str] | None = None,
        partial: Partial | None = None,
    ) -> Answer:
        """The answer to a request, repeated while that may help.

        Args:
            address: absolute.
            parameters: of the query.
            unless: headers (If-None-Match, If-Modified-Since) that name the version fetched before.
            partial: the beginning of an earlier answer.

        Raises:
            TooLargeError: the answer has more bytes than are accepted; its body is not read.
            UnansweredError: no answer after all attempts.
            SourceError: the server refuses.
        """
        try:
            url = httpx.URL(address, params=parameters) if parameters else httpx.URL(address)
        except httpx.InvalidURL as error:
            raise SourceError(
                f"{address} is not a valid address ({error}); correct location in the building file"
            ) from None
        partial = partial or Partial()
        for attempt in count():
            try:
                return self._attempt(url, unless or {}, partial)
            except BrokenError as error:
                is_last = attempt == self.manners.retries or self.manners.is_over
                if is_last or self.manners.sleep(self._delay(attempt, error.after)):
                    times = f", {attempt + 1} times" if attempt else ""
                    raise UnansweredError(f"{error}{times}; {error.helps}", partial) from error
        raise AssertionError("unreachable")

    def _delay(self, attempt: int, wanted: float | None) -> float:
        """s, growing and scattered, so that many clients do not come back together."""
        delay: float = self.settings.polling.retry_delay * 2.0**attempt * random.uniform(0.5, 1.5)
        return min(max(delay, wanted or 0.0), LONGEST_DELAY)

    def _attempt(self, url: httpx.URL, unless: Mapping[str, str], partial: Partial, redirects: int = 0) -> Answer:
        headers = dict(unless)
        if partial.body and partial.version:
            headers = {"Range": f"bytes={len(partial.body)}-", "If-Range": partial.version}
        try:
            with self.http.stream("GET", url, headers=headers, auth=self.logins.get(origin(url))) as response:
                if response.next_request is None:
                    return self._answer(response, partial)
                target = response.next_request.url
        except httpx.TimeoutException as error:
            problem = f"{url} did not answer within {self.settings.polling.timeout:g} s"
            raise BrokenError(problem) from error
        except httpx.TransportError as error:
            problem, helps = unreachable(url, error)
            raise BrokenError(problem, helps=helps) from error
        except httpx.HTTPError as error:
            raise SourceError(f"{url} cannot be requested: {error}; correct {LOCATION}") from error
        _check_redirect(url, target, redirects)
        return self._attempt(target, unless, partial, redirects + 1)

    def _answer(self, response: httpx.Response, partial: Partial) -> Answer:
        status, url = response.status_code, str(response.url)
        etag, modified = response.headers.get("etag"), response.headers.get("last-modified")
        if status in (HTTPStatus.NO_CONTENT, HTTPStatus.NOT_FOUND, HTTPStatus.NOT_MODIFIED):
            return Answer(status, b"", etag, modified)
        if status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE:
            raise TooLargeError(url, None, self.settings.polling.max_answer_bytes)
        if status == HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE and partial.body:
            partial.body.clear()
            raise BrokenError(f"{url} sent nothing after the bytes already received")
        if status in WORTH_REPEATING:
            raise BrokenError(
                f"{url} answered {status} {response.reason_phrase}",
                _seconds(response.headers.get("retry-after", "")),
            )
        if status not in (HTTPStatus.OK, HTTPStatus.PARTIAL_CONTENT):
            raise SourceError(f"{url} {refusal(status, response.reason_phrase)}")
        if status == HTTPStatus.OK or not response.headers.get("content-range", "").startswith(
            f"bytes {len(partial.body)}-"
        ):
            partial.body.clear()
        partial.version = modified if etag is None or etag.startswith("W/") else etag
        self._read(response, partial.body)
        is_delimited = not {"content-length", "transfer-encoding"}.isdisjoint(response.headers)
        age = _between(modified, response.headers.get("date"))
        return Answer(HTTPStatus.OK, bytes(partial.body), etag, modified, is_delimited, age)

    def _read(self, response: httpx.Response, body: bytearray) -> None:
        limit, began, url = self.settings.polling.max_answer_bytes, monotonic(), str(response.url)
        promised = int(response.headers.get("content-length") or 0) + len(body)
        if promised > limit:
            raise TooLargeError(url, promised, limit)
        for piece in response.iter_raw():
            body.extend(piece)
            if len(body) > limit:
                raise TooLargeError(url, None, limit)
            if monotonic() - began > LONGEST_ANSWER * self.settings.polling.timeout:
                raise BrokenError(f"{url} sent only {len(body)} bytes in {monotonic() - began:.0f} s")


def origin(url: httpx.URL) -> httpx.URL:
    """Scheme, host and port of an address (RFC 6454)."""
    return httpx.URL(scheme=url.scheme, host=url.host, port=url.port)


def _check_redirect(url: httpx.URL, target: httpx.URL, redirects: int) -> None:
    """Refuse a redirect to another server: the building file does not name it, and it may be an internal one."""
    if origin(target) != origin(url):
        raise SourceError(
            f"{url} redirects to another server, {target}, which is not requested; if that is the right one, give its "
            f"address in the building file"
        )
    if redirects >= MOST_REDIRECTS:
        raise SourceError(f"{url} redirects more than {MOST_REDIRECTS} times; correct the source in the building file")


def _seconds(written: str) -> float | None:
    """Seconds in a Retry-After header; None if it is a date, or missing."""
    return float(written) if re.fullmatch(r"[0-9]{1,9}", written) else None


def _between(earlier: str | None, later: str | None) -> timedelta | None:
    """Time between two HTTP dates; None if one of them is missing or invalid."""
    try:
        return (
            None if earlier is None or later is None else parsedate_to_datetime(later) - parsedate_to_datetime(earlier)
        )
    except (ValueError, TypeError):  # no date, or one with a zone and one without
        return None


@dataclass(slots=True)
class ServerClock:
    """Lead of a server's clock over ours, from its latest answer."""

    clock: Callable[[], datetime]
    """Ours."""
    ahead: timedelta | None = None
    """None as long as no answer gave its time."""

    def note(self, response: httpx.Response) -> None:
        """Note the time of an answer; one kept by a proxy (header Age) is ignored."""
        written = response.headers.get("date")
        if written is None or "age" in response.headers:
            return
        try:
            self.ahead = parsedate_to_datetime(written) - self.clock()
        except (ValueError, TypeError):  # no date, or one without a zone
            return


def client(
    settings: Settings,
    manners: Manners,
    note: Callable[[httpx.Response], None] | None = None,
    logins: Mapping[httpx.URL, httpx.BasicAuth] | None = None,
) -> Client:
    """A client for one source, which passes every answer to `note`; close its `http` afterwards.

    Redirects are followed within one origin only (RFC 6454).
    """
    http = httpx.Client(
        verify=tls_context(),
        timeout=httpx.Timeout(settings.polling.timeout),
        limits=httpx.Limits(max_connections=settings.polling.concurrency),
        headers={"User-Agent": f"menshin/{VERSION}", "Accept-Encoding": "identity"},
        follow_redirects=False,
        event_hooks={"response": [] if note is None else [note]},
    )
    return Client(http, settings, manners, logins or {})
