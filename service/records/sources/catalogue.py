"""Earthquakes from an FDSN event service."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta

from service import parsing
from service.formats import FormatError
from service.formats.fdsn_xml import Origin
from service.parsing import ParserDiedError
from service.records.sources.retried_requests import Client
from service.records.sources.source import SourceError


@dataclass(frozen=True, slots=True)
class Catalogue:
    """An event service, and the earthquakes to request from it."""

    address: str
    """Address of the server; its service is at /fdsnws/event/1."""
    before: timedelta
    """Fetched before an origin time."""
    after: timedelta
    """Fetched after it."""
    minimum_magnitude: float | None
    within: tuple[float, float, float] | None
    """Latitude, longitude and radius in degrees."""
    client: Client
    is_named: bool = False
    """True if the building file names it; otherwise it is the waveform server's own, if that has one."""
    patience: timedelta = timedelta(days=1)
    """Longest delay with which records and earthquakes may appear."""

    def is_offered(self) -> bool:
        """True if the server has an event service.

        Raises:
            SourceError: the request fails, or the server that the building file names has no event service.
        """
        try:
            answer = self.client.get(f"{self.address}/fdsnws/event/1/version")
            if answer.is_empty and self.is_named:
                raise SourceError(
                    f"{self.address} has no FDSN event service: nothing is served at /fdsnws/event/1/version "
                    f"below it; correct catalogue in the building file"
                )
            return not answer.is_empty
        except SourceError as error:
            if "answered 501" in str(error) or "answered 405" in str(error):
                return False
            raise

    def origins(self, start: datetime, end: datetime) -> Iterator[Origin]:
        """The earthquakes between two times, earliest first."""
        parameters = {"starttime": f"{start:%Y-%m-%dT%H:%M:%S}", "endtime": f"{end:%Y-%m-%dT%H:%M:%S}"}
        if self.minimum_magnitude is not None:
            parameters["minmagnitude"] = f"{self.minimum_magnitude:g}"
        if self.within is not None:
            parameters |= dict(zip(("latitude", "longitude", "maxradius"), map(str, self.within), strict=True))
        answer = self.client.get(f"{self.address}/fdsnws/event/1/query", parameters)
        if answer.is_empty:
            return
        try:
            yield from parsing.origins("the catalogue", answer.body, parsing.limits(self.client.settings))
        except (FormatError, ParserDiedError) as error:
            raise SourceError(f"{self.address} answered with no QuakeML: {error}") from error
