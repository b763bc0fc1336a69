"""A monitoring server: FDSN web services (station, dataselect, event) over an archive.

International Federation of Digital Seismograph Networks, FDSN Web Service Specifications 1.2 (2019).
"""

from collections.abc import Callable
from functools import partial
from io import BytesIO, StringIO

from obspy import Stream
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from service.demo.archive import Archive
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

VERSION = "1.2.0"
MINISEED = "application/vnd.fdsn.mseed"
LEVELS = ("network", "station", "channel", "response")

Answer = Callable[[Archive, dict[str, str], list[Selection]], Response | None]
"""Archive, parameters by name and selections to what was asked for, or to None where the archive has nothing of it."""


def application(archive: Archive) -> Starlette:
    """The services; where the archive knows of no earthquake, there is no event service."""
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
    found = archive.stations(selections[0])
    for more in selections[1:]:
        found += archive.stations(more)
    if not found.networks:
        return None
    if kind == "text":
        text = StringIO()
        found.write(text, format="STATIONTXT", level="channel" if level == "response" else level)
        return PlainTextResponse(text.getvalue())
    file = BytesIO()
    found.write(file, format="STATIONXML", level=level)
    return Response(file.getvalue(), media_type="application/xml")


def _waveforms(archive: Archive, named: dict[str, str], selections: list[Selection]) -> Response | None:
    if named.get("format", "miniseed") != "miniseed":
        raise QueryError(f"format must be miniseed, got {named['format']}")
    found = Stream()
    for wanted in selections:
        found += archive.waveforms(wanted)
    if not found:
        return None
    file = BytesIO()
    found.write(file, format="MSEED", reclen=512)  # int32 as Steim2, floats as they are
    return Response(file.getvalue(), media_type=MINISEED)


def _earthquakes(archive: Archive, named: dict[str, str], selections: list[Selection]) -> Response | None:
    _refuse_unheeded(named, {"starttime", "endtime", "orderby", "limit", "format", "nodata"})
    order = named.get("orderby", "time")
    if order not in {"time", "time-asc"} or named.get("format", "xml") != "xml":
        raise QueryError("earthquakes come ordered by time or time-asc, as xml")
    found = archive.earthquakes(selections[0].start, selections[0].end)
    ordered = found.events if order == "time" else found.events[::-1]
    found.events = ordered[: int(named.get("limit", len(found)))]
    if not found:
        return None
    file = BytesIO()
    found.write(file, format="QUAKEML")
    return Response(file.getvalue(), media_type="application/xml")


def _refuse_unheeded(named: dict[str, str], heeded: set[str]) -> None:
    """Refuse what the service knows but this archive does not select by: a wrong answer would look like a right one."""
    if unheeded := sorted(set(named) - heeded):
        raise QueryError(f"this archive does not select by {', '.join(unheeded)}; {', '.join(sorted(heeded))} would do")


ANSWERS: dict[str, Answer] = {"station": _stations, "dataselect": _waveforms, "event": _earthquakes}


async def _query(archive: Archive, service: str, answer: Answer, request: Request) -> Response:
    try:
        if request.method == "POST":
            pairs, selections = posted((await request.body()).decode())
            named = parameters(service, pairs.items())
        else:
            named = parameters(service, request.query_params.multi_items())
            selections = [selection(named)]
        found = await run_in_threadpool(answer, archive, named, selections) if selections else None
    except (QueryError, ValueError) as error:
        return PlainTextResponse(f"Error 400: {error}\n\nRequest: {request.url}\nService version: {VERSION}\n", 400)
    return Response(status_code=int(named.get("nodata", "204"))) if found is None else found


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
