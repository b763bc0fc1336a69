"""A monitoring server: FDSN web services (station, dataselect, event) over an archive that may grow meanwhile.

International Federation of Digital Seismograph Networks, FDSN Web Service Specifications 1.2 (2019).
"""

import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from fnmatch import fnmatchcase
from functools import partial
from io import BytesIO, StringIO
from threading import Lock, Thread

import uvicorn
from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.event import Catalog, Event
from obspy.core.inventory import Channel, Network, Station
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from service.records.fdsn_query import (
    EARLIEST,
    LATEST,
    PARAMETERS,
    SELECTION,
    QueryError,
    Selection,
    parameters,
    posted,
    selection,
)


class Archive:
    """Waveforms, stations and earthquakes; thread-safe."""

    def __init__(self, inventory: Inventory, traces: Sequence[Trace] = (), events: Sequence[Event] = ()) -> None:
        self.inventory = inventory
        self._traces = tuple(traces)
        self._events = tuple(events)
        self._growing = Lock()

    def add(self, traces: Sequence[Trace], event: Event) -> None:
        """Add a record and its earthquake."""
        with self._growing:
            self._traces += tuple(traces)
            self._events += (event,)

    def waveforms(self, selection: Selection) -> Stream:
        """Samples of the selected channels between the selected times, inclusive; may be empty."""
        selected = [trace for trace in self._traces if _holds(trace, selection)]
        return Stream(selected).slice(selection.start, selection.end)

    def stations(self, selection: Selection) -> Inventory:
        """The selected channels in operation between the selected times; may be empty."""
        networks = [_network(network, selection) for network in self.inventory]
        return Inventory(networks=[network for network in networks if network.stations], source=self.inventory.source)

    def earthquakes(self, start: UTCDateTime, end: UTCDateTime) -> Catalog:
        """The earthquakes between two times, the latest first; may be empty."""
        selected = [event for event in self._events if start <= event.preferred_origin().time <= end]
        return Catalog(sorted(selected, key=lambda event: event.preferred_origin().time, reverse=True))


def _holds(trace: Trace, selection: Selection) -> bool:
    stats = trace.stats
    return bool(
        stats.starttime <= selection.end
        and stats.endtime >= selection.start
        and _named(stats.network, selection.network)
        and _named(stats.station, selection.station)
        and _named(stats.location, selection.location)
        and _named(stats.channel, selection.channel)
    )


def _network(network: Network, selection: Selection) -> Network:
    chosen = copy(network)
    stations = [_station(station, selection) for station in network if _named(network.code, selection.network)]
    chosen.stations = [station for station in stations if station.channels]
    return chosen


def _station(station: Station, selection: Selection) -> Station:
    chosen = copy(station)
    kept = [channel for channel in station if _named(station.code, selection.station)]
    chosen.channels = [channel for channel in kept if _operating(channel, selection)]
    return chosen


def _operating(channel: Channel, selection: Selection) -> bool:
    return (
        _named(channel.location_code, selection.location)
        and _named(channel.code, selection.channel)
        and channel.is_active(starttime=selection.start, endtime=selection.end)
    )


def _named(code: str, wanted: str) -> bool:
    return any(fnmatchcase(code, "" if pattern == "--" else pattern) for pattern in wanted.split(","))


VERSION = "1.2.0"
MINISEED = "application/vnd.fdsn.mseed"
LEVELS = ("network", "station", "channel", "response")

Answer = Callable[[Archive, dict[str, str], list[Selection]], Response | None]
"""A response, from the archive, parameters by name and selections; None for no data."""


def application(archive: Archive) -> Starlette:
    """The services; an archive without earthquakes has no event service."""
    catalogued = bool(archive.earthquakes(EARLIEST, LATEST))
    routes = []
    for service in ("station", "dataselect", *(("event",) if catalogued else ())):
        root = f"/fdsnws/{service}/1"
        routes += [
            Route(f"{root}/version", _version),
            Route(f"{root}/application.wadl", partial(_description, service)),
            Route(f"{root}/query", partial(_query, archive, service, ANSWERS[service]), methods=["GET", "POST"]),
        ]
    lists = ("Catalogs", "Contributors") if catalogued else ()
    return Starlette(
        routes=[*routes, *(Route(f"/fdsnws/event/1/{name.lower()}", partial(_no_names, name)) for name in lists)]
    )


def _stations(archive: Archive, named: dict[str, str], selections: list[Selection]) -> Response | None:
    _refuse_unheeded(named, {*SELECTION, "level", "format"})
    level, kind = named.get("level", "station"), named.get("format", "xml")
    if level not in LEVELS or kind not in {"xml", "text"}:
        raise QueryError(f"level is one of {', '.join(LEVELS)} and format is xml or text, got {level} and {kind}")
    inventory = archive.stations(selections[0])
    for more in selections[1:]:
        inventory += archive.stations(more)
    if not inventory.networks:
        return None
    if kind == "text":
        text = StringIO()
        inventory.write(text, format="STATIONTXT", level="channel" if level == "response" else level)
        return PlainTextResponse(text.getvalue())
    file = BytesIO()
    inventory.write(file, format="STATIONXML", level=level)
    return Response(file.getvalue(), media_type="application/xml")


def _waveforms(archive: Archive, named: dict[str, str], selections: list[Selection]) -> Response | None:
    if named.get("format", "miniseed") != "miniseed":
        raise QueryError(f"format must be miniseed, got {named['format']}")
    stream = Stream()
    for wanted in selections:
        stream += archive.waveforms(wanted)
    if not stream:
        return None
    file = BytesIO()
    stream.write(file, format="MSEED", reclen=512)  # int32 as Steim2, floats unchanged
    return Response(file.getvalue(), media_type=MINISEED)


def _earthquakes(archive: Archive, named: dict[str, str], selections: list[Selection]) -> Response | None:
    _refuse_unheeded(named, {"starttime", "endtime", "orderby", "limit", "format", "nodata"})
    order = named.get("orderby", "time")
    if order not in {"time", "time-asc"} or named.get("format", "xml") != "xml":
        raise QueryError("earthquakes come ordered by time or time-asc, as xml")
    catalog = archive.earthquakes(selections[0].start, selections[0].end)
    ordered = catalog.events if order == "time" else catalog.events[::-1]
    catalog.events = ordered[: int(named.get("limit", len(catalog)))]
    if not catalog:
        return None
    file = BytesIO()
    catalog.write(file, format="QUAKEML")
    return Response(file.getvalue(), media_type="application/xml")


def _refuse_unheeded(named: dict[str, str], heeded: set[str]) -> None:
    """Reject parameters of the specification that this archive does not support: a wrong response would look right."""
    if unheeded := sorted(set(named) - heeded):
        raise QueryError(f"this archive does not select by {', '.join(unheeded)}; use {', '.join(sorted(heeded))}")


ANSWERS: dict[str, Answer] = {"station": _stations, "dataselect": _waveforms, "event": _earthquakes}


async def _query(archive: Archive, service: str, answer: Answer, request: Request) -> Response:
    try:
        if request.method == "POST":
            pairs, selections = posted((await request.body()).decode())
            named = parameters(service, pairs.items())
        else:
            named = parameters(service, request.query_params.multi_items())
            selections = [selection(named)]
        response = await run_in_threadpool(answer, archive, named, selections) if selections else None
    except (QueryError, ValueError) as error:
        return PlainTextResponse(f"Error 400: {error}\n\nRequest: {request.url}\nService version: {VERSION}\n", 400)
    return Response(status_code=int(named.get("nodata", "204"))) if response is None else response


def _version(_: Request) -> Response:
    return PlainTextResponse(VERSION)


def _no_names(kind: str, _: Request) -> Response:
    return Response(f"<{kind}></{kind}>", media_type="application/xml")


def _description(service: str, request: Request) -> Response:
    params = "".join(f'<param name="{name}" style="query"/>' for name in PARAMETERS[service])
    return Response(
        f'<?xml version="1.0"?><application xmlns="http://wadl.dev.java.net/2009/02">'
        f'<resources base="{request.base_url}fdsnws/{service}/1"><resource path="query">'
        f'<method id="query" name="GET"><request>{params}</request></method>'
        f"</resource></resources></application>",
        media_type="application/xml",
    )


LOOPBACK = "127.0.0.1"


@contextmanager
def listening(application: Starlette, port: int = 0) -> Iterator[str]:
    """Serve the application on loopback from a thread; yields its address. Port 0 selects a free one."""
    with socket.create_server((LOOPBACK, port)) as door:
        server = uvicorn.Server(uvicorn.Config(application, log_level="warning", lifespan="off"))
        thread = Thread(target=server.run, args=([door],), name="monitoring server", daemon=True)
        thread.start()
        while not server.started and thread.is_alive():
            time.sleep(0.01)
        try:
            yield f"http://{LOOPBACK}:{door.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(timeout=10.0)


def free_port(wanted: int) -> int:
    """The given port if it is free, otherwise another one."""
    for port in (wanted, 0):
        try:
            with socket.create_server((LOOPBACK, port)) as door:
                return int(door.getsockname()[1])
        except OSError:
            continue
    raise OSError(f"no port is free at {LOOPBACK}")
