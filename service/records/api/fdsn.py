"""FDSN web services for stored records; their own documents (application.wadl) describe them, as clients expect."""

from collections import Counter
from collections.abc import Callable, Sequence
from io import BytesIO, StringIO
from threading import Lock
from typing import Literal, TypeVar

from anyio import to_thread
from fastapi import APIRouter, Request, Response
from starlette.exceptions import HTTPException

from service.access.auth import caller
from service.http.forms import read_body
from service.http.guard import FDSN_BODY
from service.http.parameters import Reading
from service.records import fdsn
from service.records.fdsn_query import (
    ALIASES,
    PARAMETERS,
    QueryError,
    Selection,
    area,
    parameters,
    posted,
    selection,
)
from service.version import VERSION

MINISEED = "application/vnd.fdsn.mseed"
router = APIRouter(prefix="/fdsnws", include_in_schema=False)
Service = Literal["station", "dataselect"]
Given = Sequence[tuple[str, str]]
TIMES = ("starttime", "endtime")
LEVELS: tuple[fdsn.Level, ...] = ("station", "network", "channel", "response")
Choice = TypeVar("Choice", bound=str)
AT_ONCE = 2
"""Requests with one key that are answered at the same time."""
COUNTING = Lock()
FORMS: dict[str, tuple[Callable[[], BytesIO | StringIO], str, str]] = {
    "xml": (BytesIO, "STATIONXML", "application/xml"),
    "text": (StringIO, "STATIONTXT", "text/plain"),
}


@router.get("/{service}/1/version")
async def version(service: Service) -> Response:
    """Version of the service."""
    return Response(VERSION, media_type="text/plain")


@router.get("/{service}/1/application.wadl")
async def description(service: Service, request: Request) -> Response:
    """Parameters of the service, for programs."""
    short = {long: name for name, long in ALIASES.items()}
    names = [name for long in PARAMETERS[service] for name in (long, short.get(long)) if name]
    rows = "".join(
        f'<param name="{name}" style="query" type="xs:{"dateTime" if ALIASES.get(name, name) in TIMES else "string"}"/>'
        for name in names
    )
    document = (
        '<?xml version="1.0" encoding="UTF-8"?><application xmlns="http://wadl.dev.java.net/2009/02" '
        'xmlns:xs="http://www.w3.org/2001/XMLSchema">'
        f'<resources base="{base(request)}/fdsnws/{service}/1"><resource path="query">'
        f'<method name="GET"><request>{rows}</request></method><method name="POST"/>'
        "</resource></resources></application>"
    )
    return Response(document, media_type="application/xml")


@router.get("/station/1/query")
def station(request: Request, sessions: Reading) -> Response:
    """Networks, stations and channels as StationXML or text."""
    given = request.query_params.multi_items()
    return answered(request, lambda: stations(request, sessions, given))


@router.post("/station/1/query")
async def station_posted(request: Request, sessions: Reading) -> Response:
    """Networks, stations and channels of several selections."""
    return await answered_post(request, lambda body: stations(request, sessions, *wanted(body)))


@router.get("/dataselect/1/query")
def dataselect(request: Request, sessions: Reading) -> Response:
    """Samples as miniSEED."""
    given = request.query_params.multi_items()
    return answered(request, lambda: samples(request, sessions, given))


@router.post("/dataselect/1/query")
async def dataselect_posted(request: Request, sessions: Reading) -> Response:
    """Samples of several selections as miniSEED."""
    return await answered_post(request, lambda body: samples(request, sessions, *wanted(body)))


def answered(request: Request, answer: Callable[[], Response]) -> Response:
    """The answer, or an error in the form of the specification."""
    under_way: Counter[str] = request.app.state.questions
    name = caller(request).name
    with COUNTING:
        if under_way[name] >= AT_ONCE:
            return refusal(request, 429, f"{AT_ONCE} requests with the same key are being answered; try again later")
        under_way[name] += 1
    try:
        return answer()
    except QueryError as error:
        return refusal(request, error.status, str(error))
    finally:
        with COUNTING:
            under_way[name] -= 1
            under_way += Counter()  # drops names without a request


async def answered_post(request: Request, answer: Callable[[str], Response]) -> Response:
    """The answer to a posted request, or an error."""
    try:
        body = await read_body(request, FDSN_BODY)
    except HTTPException as error:  # the guard's, which counts the body as it comes
        return refusal(request, error.status_code, error.detail)
    return await to_thread.run_sync(answered, request, lambda: answer(body))


def wanted(body: str) -> tuple[Given, list[Selection]]:
    """Posted parameters and selections, at least one."""
    given, selections = posted(body)
    if not selections:
        raise QueryError("no selection was posted; post a line 'NET STA LOC CHA START END'")
    return list(given.items()), selections


def stations(
    request: Request, sessions: Reading, given: Given, selections: Sequence[Selection] | None = None
) -> Response:
    """The wanted networks, stations and channels, or the answer for no data."""
    named = parameters("station", given)
    level = one_of(named, "level", LEVELS)
    form = one_of(named, "format", ("xml", "text"))
    if form == "text" and level == "response":
        raise QueryError("format=text needs level=network, station or channel")
    with sessions() as session:
        content = fdsn.inventory(session, selections or [selection(named)], area(named), level)
    if not content.networks:
        return nothing(request, named.get("nodata", "204"))
    out, written, media_type = FORMS[form]
    with out() as stream:
        content.write(stream, format=written, level=level)
        return Response(stream.getvalue(), media_type=media_type)


def samples(
    request: Request, sessions: Reading, given: Given, selections: Sequence[Selection] | None = None
) -> Response:
    """The wanted samples, or the answer for no data."""
    named = parameters("dataselect", given)
    one_of(named, "format", ("miniseed",))
    most = request.app.state.settings.max_dataselect_samples
    with sessions() as session:
        content = fdsn.miniseed(session, selections or [selection(named)], most)
    if content is None:
        return nothing(request, named.get("nodata", "204"))
    return Response(content, media_type=MINISEED)


def one_of(named: dict[str, str], name: str, known: tuple[Choice, ...]) -> Choice:
    """The value of a parameter; by default the first known one."""
    given = named.get(name, known[0])
    for one in known:
        if one == given:
            return one
    raise QueryError(f"{name} must be {', '.join(known)}, got {given}")


def nothing(request: Request, status: str) -> Response:
    """The answer for no data: 204, or 404 if the client chose that."""
    return Response(status_code=204) if status == "204" else refusal(request, 404, "nothing stored matches")


def base(request: Request) -> str:
    """The address in the settings, because a client may write any Host header."""
    return (request.app.state.settings.public_url or "").rstrip("/")


def refusal(request: Request, status: int, reason: str) -> Response:
    """An error in the form of the specification."""
    address = f"{base(request)}{request.url.path}?{request.url.query}"
    text = f"Error {status}: {reason}\n\nRequest:\n{address}\n\nService version: {VERSION}\n"
    return Response(text, status, media_type="text/plain")
