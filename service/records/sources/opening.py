"""The source that a building file names."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

import httpx

from service.addresses import web_address_problem
from service.buildings.description import BuildingFile, SourceFile
from service.records.sources.archive import Archive
from service.records.sources.catalogue import Catalogue
from service.records.sources.fdsnws import EARLIEST, FdsnWebServices
from service.records.sources.folder import Folder
from service.records.sources.retried_requests import Client, Manners, client, origin
from service.records.sources.source import Memory, Source, SourceError
from service.settings import Settings


@contextmanager
def opened(
    building: BuildingFile,
    source: SourceFile,
    settings: Settings,
    memory: Memory,
    manners: Manners,
    note: Callable[[httpx.Response], None] | None = None,
) -> Iterator[Source]:
    """The source, with its connections closed afterwards; `note` is called with every answer.

    Raises:
        SourceError: its address is invalid, which an earlier version accepted in a building file.
    """
    if source.kind == "folder":
        yield Folder(Path(source.location), settings.polling.max_answer_bytes, settings.polling.settle_time, memory)
        return
    for key, address in (("location", source.location), ("catalogue", source.catalogue)):
        if address is not None and (problem := web_address_problem(address)):
            raise SourceError(f"{key} in the building file: {problem}")
    logins = dict(filter(None, (login(address) for address in (source.location, source.catalogue) if address)))
    http_client = client(settings, manners, note, logins)
    try:
        if source.kind == "archive":
            yield Archive(without_login(source.location), http_client, memory)
        else:
            yield _fdsnws(building, source, http_client)
    finally:
        http_client.http.close()


def _fdsnws(building: BuildingFile, source: SourceFile, http_client: Client) -> FdsnWebServices:
    return FdsnWebServices(
        address=_server(source.location),
        channels=tuple(channel.id for channel in building.description.channels),
        since=source.since or EARLIEST,
        catalogue=_catalogue(building, source, http_client) if source.data == "events" else None,
        client=http_client,
    )


def _catalogue(building: BuildingFile, source: SourceFile, http_client: Client) -> Catalogue:
    within = None
    if source.maximum_radius is not None and building.latitude is not None and building.longitude is not None:
        within = (building.latitude, building.longitude, source.maximum_radius)
    return Catalogue(
        address=_server(source.catalogue or source.location),
        before=timedelta(seconds=source.before),
        after=timedelta(seconds=source.after),
        minimum_magnitude=source.minimum_magnitude,
        within=within,
        client=http_client,
        is_named=source.catalogue is not None,
    )


def _server(location: str) -> str:
    return without_login(location).split("/fdsnws")[0].rstrip("/")


def login(address: str) -> tuple[httpx.URL, httpx.BasicAuth] | None:
    """The name and password in an address, with the origin they belong to."""
    url = _parsed(address)
    return (origin(url), httpx.BasicAuth(url.username, url.password)) if url.userinfo else None


def without_login(address: str) -> str:
    """The address without name and password."""
    url = _parsed(address)
    return str(url.copy_with(username=None, password=None)) if url.userinfo else address


def _parsed(address: str) -> httpx.URL:
    try:
        return httpx.URL(address)
    except httpx.InvalidURL as error:
        raise SourceError(
            f"the address of the source is not valid ({error}); correct it in the building file"
        ) from None
