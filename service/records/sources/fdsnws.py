"""A monitoring server with FDSN web services: station, dataselect, and event where it offers one.

International Federation of Digital Seismograph Networks, FDSN Web Service Specifications 1.2 (2019).
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from http import HTTPStatus
from typing import Any

from service import parsing
from service.db.process_leases import has_passed
from service.formats.waveforms import Piece
from service.parsing import Limits
from service.records.sources.catalogue import Catalogue
from service.records.sources.late_data import Gap, gaps, noted, pieces, reached, still_open, written
from service.records.sources.problems import LOCATION, incomplete, is_page, titled
from service.records.sources.retried_requests import Client
from service.records.sources.source import Arrival, Cursor, SourceError, Step, TooLargeError

EARLIEST = datetime(1990, 1, 1, tzinfo=UTC)
FIRST_WINDOW = timedelta(hours=1)
"""Span of the first request for waveforms; later ones adapt. Not tuned."""
LONGEST_WINDOW = timedelta(days=366)
"""Longest span of a request, doubled up to it while little arrives. Not tuned."""
SHORTEST_WINDOW = timedelta(seconds=60)
"""Span to which too large requests are halved. Not tuned."""
STATIONS_HOLD = timedelta(days=1)
"""Time after which station files are requested again. Not tuned."""
A_MOMENT = timedelta(seconds=60)
"""Lead of a recorder's clock over ours that is no error."""
WRITTEN = re.compile(rb"<Created>[^<]{0,100}</Created>")


@dataclass(frozen=True, slots=True)
class FdsnWebServices:
    """Stations first, then waveforms: around the catalogue's earthquakes, or all of them in windows of time.

    A gap in a channel is requested again at each poll, until it is filled or the setting `late_data` has passed.
    """

    address: str
    """Address of the server; its services are at /fdsnws."""
    channels: tuple[str, ...]
    """Ids."""
    since: datetime
    catalogue: Catalogue | None
    client: Client

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """New stations and waveforms."""
        for step in self._stations(cursor, now):
            cursor = step.cursor
            yield step
        for step in self._late(cursor, now):
            cursor = step.cursor
            yield step
        if self.catalogue is not None and self.catalogue.is_offered():
            yield from self._around_earthquakes(self.catalogue, cursor, now)
        else:
            yield from self._in_windows(cursor, now)

    def _stations(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        looked = cursor.get("stations_at")
        if looked is not None and not has_passed(datetime.fromisoformat(looked) + STATIONS_HOLD, now, STATIONS_HOLD):
            return
        codes = [channel.split(".") for channel in self.channels]
        parameters = {
            "network": _either(code[0] for code in codes),
            "station": _either(code[1] for code in codes),
            "level": "response",
        }
        answer = self.client.get(f"{self.address}/fdsnws/station/1/query", parameters)
        if answer.status == HTTPStatus.NOT_FOUND and cursor.get("server") != self.address:
            self._check_services()  # some FDSN servers answer 404 where there is no result, others have no stations
            cursor = {**cursor, "server": self.address}
        elif is_page(answer.body):
            raise SourceError(
                f"{self.address} answered with {titled(answer.body)} in place of StationXML: this is not an "
                f"FDSN server; correct {LOCATION}"
            )
        digest = sha256(WRITTEN.sub(b"", answer.body)).hexdigest()  # it is written anew for every request
        if answer.is_empty or digest == cursor.get("stations"):
            yield Step((), {**cursor, **({} if answer.is_empty else {"stations_at": now.isoformat()})})
            return
        arrival = Arrival(name="station.xml", origin=f"{self.address}/fdsnws/station/1", data=answer.body)
        yield Step((arrival,), {**cursor, "stations": digest, "stations_at": now.isoformat()})

    def _check_services(self) -> None:
        """Refuse a server without the service that every FDSN server has.

        Raises:
            SourceError: there is none.
        """
        if self.client.get(f"{self.address}/fdsnws/dataselect/1/version").status != HTTPStatus.OK:
            raise SourceError(
                f"{self.address} is not an FDSN server: nothing is served at /fdsnws/dataselect/1/version below "
                f"it; correct {LOCATION}"
            )

    def _late(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """Waveforms that have come since for the open gaps."""
        had = still_open(noted(cursor.get("open", [])), now, self._lateness)
        left: list[Gap] = []
        for number, gap in enumerate(had, start=1):
            arrivals = tuple(self._arrivals(gap))
            yield from self._broken(arrivals, cursor)
            left += gaps(self._pieces(arrivals), gap)
            cursor = {**cursor, "open": written([*left, *had[number:]])}
            yield Step(arrivals, cursor)

    def _open(self, cursor: Cursor, more: Iterable[Gap], now: datetime) -> list[dict[str, Any]]:
        """The gaps to request again at the next polls, as JSON."""
        return written(still_open([*noted(cursor.get("open", [])), *more], now, self._lateness))

    def _pieces(self, arrivals: Iterable[Arrival]) -> tuple[Piece, ...]:
        return pieces((arrival.data for arrival in arrivals if arrival.data is not None), self._limits)

    @property
    def _limits(self) -> Limits:
        return parsing.limits(self.client.settings)

    @property
    def _lateness(self) -> timedelta:
        return timedelta(seconds=self.client.settings.polling.late_data)

    def _around_earthquakes(self, catalogue: Catalogue, cursor: Cursor, now: datetime) -> Iterator[Step]:
        done: dict[str, str] = dict(cursor.get("earthquakes", {}))
        until = datetime.fromisoformat(cursor["catalogue_until"]) if "catalogue_until" in cursor else self.since
        resume = max(self.since, now - catalogue.patience - catalogue.before - catalogue.after)
        until = min(until, resume)  # later only if the clock was ahead, and has been set back
        for origin in catalogue.origins(until, now):
            wanted = Gap(origin.time - catalogue.before, origin.time + catalogue.after, self.channels)
            if origin.id in done or wanted.end > now:
                continue
            arrivals = tuple(self._arrivals(wanted))
            yield from self._broken(arrivals, cursor)
            if arrivals or now - wanted.end > catalogue.patience:
                done[origin.id] = origin.time.isoformat()
                cursor = {**cursor, "open": self._open(cursor, gaps(self._pieces(arrivals), wanted), now)}
            cursor = {**cursor, "earthquakes": dict(done)}
            yield Step(arrivals, cursor)
        kept = {key: time for key, time in done.items() if datetime.fromisoformat(time) >= resume}
        yield Step((), {**cursor, "earthquakes": kept, "catalogue_until": resume.isoformat()})

    def _in_windows(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """Windows that double over silence, so that years of it cost a few requests, and halve on large answers."""
        start = datetime.fromisoformat(cursor["until"]) if "until" in cursor else self.since
        if start > now + A_MOMENT:  # the clock was ahead at the last poll, and has been set back
            start = max(self.since, now - self._lateness)
        window = timedelta(seconds=cursor.get("window", FIRST_WINDOW.total_seconds()))
        while start < now:
            end, limit = min(start + window, now), self.client.settings.polling.max_answer_bytes
            try:
                body = self._waveforms(Gap(start, end, self.channels))
                arrivals = () if body is None else (self._arrival(start, end, body),)
            except TooLargeError as error:
                if end - start > SHORTEST_WINDOW:
                    window = max((end - start) / 2, SHORTEST_WINDOW)
                    continue
                body, arrivals = None, (self._arrival(start, end, None, str(error)),)
            yield from self._broken(arrivals, cursor)
            if body is None or len(body) < limit // 16:
                window = min(2 * window, LONGEST_WINDOW)
            elif len(body) > limit // 4:
                window = max(window / 2, SHORTEST_WINDOW)
            progress = self._progress(Gap(start, end, self.channels), arrivals, cursor, now)
            cursor = {**cursor, **progress, "window": window.total_seconds()}
            yield Step(arrivals, cursor)
            start = end

    def _progress(self, window: Gap, arrivals: tuple[Arrival, ...], cursor: Cursor, now: datetime) -> dict[str, Any]:
        """Start of the next window, and the gaps left in this one."""
        there, until = self._pieces(arrivals), window.end
        if window.end >= now and not (arrivals and arrivals[0].refusal):
            until = reached(there, window.start, max(window.start, now - self._lateness))
        left = gaps(there, Gap(window.start, until, self.channels))
        return {"until": until.isoformat(), "open": self._open(cursor, left, now)}

    def _broken(self, arrivals: tuple[Arrival, ...], cursor: Cursor) -> Iterator[Step]:
        """Keep a page or half a file that came in place of waveforms; the cursor stays, so they are requested again.

        Raises:
            SourceError: there is one.
        """
        for arrival in arrivals:
            if arrival.data is not None and (fault := incomplete(arrival.name, arrival.data, self._limits)) is not None:
                yield Step((arrival,), cursor)
                raise SourceError(f"{arrival.origin} answered with no whole miniSEED: {fault}")

    def _arrivals(self, wanted: Gap) -> Iterator[Arrival]:
        """The waveforms of a span of time, in halves where they are too large in one."""
        try:
            body = self._waveforms(wanted)
        except TooLargeError as error:
            if wanted.end - wanted.start <= SHORTEST_WINDOW:
                yield self._arrival(wanted.start, wanted.end, None, str(error))
                return
            middle = wanted.start + (wanted.end - wanted.start) / 2
            yield from self._arrivals(Gap(wanted.start, middle, wanted.channels))
            yield from self._arrivals(Gap(middle, wanted.end, wanted.channels))
            return
        if body is not None:
            yield self._arrival(wanted.start, wanted.end, body)

    def _waveforms(self, wanted: Gap) -> bytes | None:
        codes = list(zip(*(channel.split(".") for channel in wanted.channels), strict=True))
        names = ("network", "station", "location", "channel")
        parameters = {name: _either(code or "--" for code in column) for name, column in zip(names, codes, strict=True)}
        parameters |= {"starttime": _written(wanted.start), "endtime": _written(wanted.end)}
        answer = self.client.get(f"{self.address}/fdsnws/dataselect/1/query", parameters)
        if answer.status not in (200, 204, 404):
            raise SourceError(f"{self.address} answered {answer.status} to an unconditional request")
        return None if answer.is_empty or not answer.body else answer.body

    def _arrival(self, start: datetime, end: datetime, data: bytes | None, refusal: str | None = None) -> Arrival:
        name = f"{start:%Y%m%dT%H%M%S}-{end:%Y%m%dT%H%M%S}.mseed"
        return Arrival(name=name, origin=f"{self.address}/fdsnws/dataselect/1/query", data=data, refusal=refusal)


def _either(codes: Iterator[str]) -> str:
    return ",".join(dict.fromkeys(codes))


def _written(time: datetime) -> str:
    return time.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%f")
