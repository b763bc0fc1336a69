"""Responses as JSON or CSV, with an entity tag, so that a client with a current copy receives 304.

`TaggedRoute` is the route class of every router whose answers a client may keep. Its endpoints return models, which it
writes as JSON or CSV and tags by their bytes; or, where the tag is cheaper to compute than the content, as for series
and pictures, a `Tagged`. Pages, streams and files pass it unchanged.
"""

import csv
import hashlib
import io
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Iterable, Mapping
from threading import Lock
from typing import Annotated, Any, Literal

import orjson
from fastapi import Depends, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.routing import APIRoute
from pydantic import BaseModel

from service.access.auth import caller
from service.http.paging import row_model
from service.http.problems import openapi_responses
from service.language.choice import spoken
from service.version import VERSION

Format = Annotated[
    Literal["json", "csv"] | None,
    Query(description="Form of the answer; without it the header Accept decides, and JSON is the default."),
]
JSON = "application/json"
CSV = "text/csv"
CSV_EXAMPLE = (
    "A header line with the names of the columns, then one line a row; an empty field is null. A text "
    "that a spreadsheet would take for a formula begins with an apostrophe."
)
FORMULAS = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a text that a spreadsheet would run as a formula."""
CACHED = 32 * 2**20
"""Bytes of response bodies that a process keeps."""


class Answers:
    """The latest response bodies by their tags; thread-safe."""

    def __init__(self, most: int = CACHED) -> None:
        self._most = most
        self._size = 0
        self._bodies: OrderedDict[str, bytes] = OrderedDict()
        self._lock = Lock()

    def find(self, etag: str) -> bytes | None:
        """The body with that tag, if it is still in memory."""
        with self._lock:
            if etag in self._bodies:
                self._bodies.move_to_end(etag)
            return self._bodies.get(etag)

    def keep(self, etag: str, body: bytes) -> None:
        """Store a body; the least recently used ones make room for it."""
        with self._lock:
            self._size += len(body) - len(self._bodies.pop(etag, b""))
            self._bodies[etag] = body
            while self._size > self._most:
                self._size -= len(self._bodies.popitem(last=False)[1])


class Tagged(Response):
    """A response that some values determine, computed only for a client without a current copy.

    Args:
        make: its content; runs in a thread.
        media_type: of the content.
        identity: values that determine the content, besides the version of the code and the language.
    """

    def __init__(self, make: Callable[[], bytes], media_type: str, *identity: object) -> None:
        super().__init__(media_type=media_type)
        self.name: str | None = None
        """File name under which a browser saves it; None: by its address."""
        self.make = make
        self.etag = tag(VERSION, media_type, spoken(), *identity)


class TaggedRoute(APIRoute):
    """A route that writes a model as JSON, or a table as CSV on request, with an entity tag."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler of the framework, with its response tagged."""
        handle = super().get_route_handler()
        is_table = CSV in self.responses.get(200, {}).get("content", {})

        async def answered(request: Request) -> Response:
            response = await handle(request)
            if isinstance(response, Tagged):
                return await _made(request, response)
            is_model = response.headers.get("content-type") == JSON
            if request.method != "GET" or response.status_code != 200 or not is_model:
                return response
            body = bytes(response.body)
            return _table(request, self.response_model, body) if is_table else _written(request, body, JSON)

        return answered


async def _made(request: Request, answer: Tagged) -> Response:
    """The response; a body in memory is for callers of the same buildings only, because nothing checks it again."""
    buildings = caller(request).buildings
    etag = answer.etag if buildings is None else tag(answer.etag, sorted(buildings))
    if is_known(request, etag):
        return _unchanged(etag)
    answers: Answers = request.app.state.answers
    body = answers.find(etag)
    if body is None:
        body = await run_in_threadpool(answer.make)
        answers.keep(etag, body)
    named = {} if answer.name is None else {"Content-Disposition": f'inline; filename="{answer.name}"'}
    return Response(body, headers=_caching(etag) | named, media_type=answer.media_type)


def _written(request: Request, body: bytes, media_type: str, headers: Mapping[str, str] | None = None) -> Response:
    """A response with the tag of its bytes, or 304."""
    etag = tag(body)
    if is_known(request, etag):
        return _unchanged(etag)
    return Response(body, headers=_caching(etag) | dict(headers or {}), media_type=media_type)


def _table(request: Request, model: type[BaseModel], body: bytes) -> Response:
    """A table as JSON or CSV; the header Link names the next page."""
    content: dict[str, Any] = orjson.loads(body)
    headers = _link(request, content["next"])
    if not wants_csv(request, request.query_params.get("format")):
        return _written(request, body, JSON, headers)
    row = row_model(model)
    lines = _csv(row.model_fields, [row.cells(one) for one in content["items"]])
    return _written(request, lines, CSV, headers)


def _link(request: Request, following: str | None) -> dict[str, str]:
    url = request.url.include_query_params(cursor=following)  # relative, because the client chooses the Host header
    return {} if following is None else {"Link": f'<{url.path}?{url.query}>; rel="next"'}


def wants_csv(request: Request, format: str | None) -> bool:
    """True if the client requests CSV."""
    if format is not None:
        return format == "csv"
    accepted = [part.split(";")[0].strip() for part in request.headers.get("accept", "").split(",")]
    return "text/csv" in accepted and "application/json" not in accepted


def tag(*identity: object) -> str:
    """The entity tag of a response that these values determine."""
    return f'"{hashlib.sha256(repr(identity).encode()).hexdigest()[:32]}"'


def is_known(request: Request, etag: str) -> bool:
    """True if the client has this response already."""
    known = request.headers.get("if-none-match", "")
    return known == "*" or etag in (part.strip().removeprefix("W/") for part in known.split(","))


def _unchanged(etag: str) -> Response:
    """304: the client's copy is current."""
    return Response(status_code=304, headers=_caching(etag))


def _caching(etag: str) -> dict[str, str]:
    """Caching headers: only the client keeps it, and revalidates it, so that a new analysis shows at once."""
    return {
        "ETag": etag,
        "Cache-Control": "private, no-cache",
        "Vary": "Accept, Accept-Language, Authorization, Cookie, X-API-Key",
    }


def _csv(columns: Iterable[str], rows: Iterable[Iterable[Any]]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue().encode()


def _cell(value: object) -> object:
    """A cell: lists with semicolons, objects as JSON; an apostrophe before a text that a spreadsheet would run."""
    text = "; ".join(map(str, value)) if isinstance(value, list) else value
    text = orjson.dumps(value).decode() if isinstance(value, dict) else text
    return f"'{text}" if isinstance(text, str) and text.startswith(FORMULAS) else text


def _declared(format: Format = None) -> None:
    """The parameter `format` of a table."""


def responses(model: type[BaseModel], *statuses: int, csv: bool = False) -> dict[str, Any]:
    """The OpenAPI description of an operation's responses: its content, 304, and each problem."""
    content: dict[str, Any] = {CSV: {"schema": {"type": "string", "description": CSV_EXAMPLE}}} if csv else {}
    tagged = {"ETag": {"description": "Tag of this answer, for If-None-Match.", "schema": {"type": "string"}}}
    special = {
        200: {"headers": tagged, "content": content},
        304: {"description": "Unchanged since the tag in If-None-Match."},
    }
    return {"response_model": model, "responses": special | openapi_responses(401, 403, 422, *statuses)}


def file_responses(media_type: str, description: str, *statuses: int) -> dict[str, Any]:
    """The same for a file, which the endpoint returns as `Tagged`."""
    described = responses(BaseModel, *statuses)["responses"]
    schema = {"type": "string", "description": description}
    described[200] = described[200] | {"content": {media_type: {"schema": schema}}, "description": description}
    return {"response_class": Response, "response_model": None, "responses": described}


def table_responses(model: type[BaseModel], *statuses: int) -> dict[str, Any]:
    """The same for a table, which is JSON or CSV by the parameter `format`."""
    return responses(model, *statuses, csv=True) | {"dependencies": [Depends(_declared)]}
