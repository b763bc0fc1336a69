"""FDSN web services for what is stored; their own documents (application.wadl) describe them, as clients expect."""

from io import BytesIO
from typing import Literal

from anyio import to_thread
from fastapi import APIRouter, Request, Response

from service import fdsn
from service.fdsn_query import ALIASES, PARAMETERS, QueryError, Selection, parameters, posted, selection
from service.parameters import Reading
from service.version import VERSION

router = APIRouter(prefix="/fdsnws", include_in_schema=False)
Service = Literal["station", "dataselect"]
TIMES = ("starttime", "endtime")


@router.get("/{service}/1/version")
async def version(service: Service) -> Response:
    """Version of the service."""
    return Response(VERSION, media_type="text/plain")


@router.get("/{service}/1/application.wadl")
async def description(service: Service, request: Request) -> Response:
    """What the service understands, for programs."""
    short = {long: name for name, long in ALIASES.items()}
    names = [name for long in PARAMETERS[service] for name in (long, short.get(long)) if name]
    rows = "".join(
        f'<param name="{name}" style="query" type="xs:{"dateTime" if ALIASES.get(name, name) in TIMES else "string"}"/>'
        for name in names
    )
    posts = '<method name="POST"/>' if service == "dataselect" else ""
    document = (
        '<?xml version="1.0" encoding="UTF-8"?><application xmlns="http://wadl.dev.java.net/2009/02" '
        'xmlns:xs="http://www.w3.org/2001/XMLSchema">'
        f'<resources base="{request.base_url}fdsnws/{service}/1"><resource path="query">'
        f'<method name="GET"><request>{rows}</request></method>{posts}</resource></resources></application>'
    )
    return Response(document, media_type="application/xml")


@router.get("/station/1/query")
def station(request: Request, sessions: Reading) -> Response:
    """Networks, stations and channels as StationXML or text."""
    try:
        named = parameters("station", request.query_params.multi_items())
        level = one_of(named, "level", ("station", "network", "channel", "response"))
        form = one_of(named, "format", ("xml", "text"))
        if form == "text" and level == "response":
            raise QueryError("format=text goes with level=network, station or channel")
        with sessions() as session:
            found = fdsn.inventory(session, selection(named))
    except QueryError as error:
        return refusal(request, error)
    if not found.networks:
        return nothing(request, named.get("nodata", "204"))
    out = BytesIO()
    if form == "text":
        found.write(out, format="STATIONTXT", level=level)
        return Response(out.getvalue(), media_type="text/plain")
    found.write(out, format="STATIONXML", level=level)
    return Response(out.getvalue(), media_type="application/xml")


@router.get("/dataselect/1/query")
def dataselect(request: Request, sessions: Reading) -> Response:
    """Samples as miniSEED."""
    try:
        named = parameters("dataselect", request.query_params.multi_items())
        return selected(request, sessions, named, [selection(named)])
    except QueryError as error:
        return refusal(request, error)


@router.post("/dataselect/1/query")
async def dataselect_posted(request: Request, sessions: Reading) -> Response:
    """Samples of several selections as miniSEED."""
    body = (await request.body()).decode("utf-8", "replace")
    try:
        given, selections = posted(body)
        if not selections:
            raise QueryError("no selection was posted; a line 'NET STA LOC CHA START END' would do")
        named = parameters("dataselect", given.items())
        return await to_thread.run_sync(selected, request, sessions, named, selections)
    except QueryError as error:
        return refusal(request, error)


def selected(request: Request, sessions: Reading, named: dict[str, str], selections: list[Selection]) -> Response:
    """The wanted samples, or that there are none."""
    one_of(named, "format", ("miniseed",))
    with sessions() as session:
        found = fdsn.miniseed(session, selections)
    if found is None:
        return nothing(request, named.get("nodata", "204"))
    return Response(found, media_type="application/vnd.fdsn.mseed")


def one_of(named: dict[str, str], name: str, known: tuple[str, ...]) -> str:
    """The value of a parameter, the first of those known unless it is given."""
    value = named.get(name, known[0])
    if value not in known:
        raise QueryError(f"{name} must be {', '.join(known)}, got {value}")
    return value


def refusal(request: Request, error: QueryError) -> Response:
    """400 in the words that the specification lays down."""
    return Response(words(request, 400, str(error)), 400, media_type="text/plain")


def nothing(request: Request, status: str) -> Response:
    """Nothing matches: 204, or 404 where the client asked for that."""
    if status == "204":
        return Response(status_code=204)
    return Response(words(request, 404, "nothing stored matches"), 404, media_type="text/plain")


def words(request: Request, status: int, reason: str) -> str:
    """An error's text."""
    return f"Error {status}: {reason}\n\nRequest:\n{request.url}\n\nService version: {VERSION}\n"
