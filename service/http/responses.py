"""Responses: JSON or CSV, with an entity tag so that a client that has the answer already gets 304.

Endpoints return models; `TaggedRoute` writes them as JSON or CSV and tags them. Answers whose tag is cheaper to compute
than their content, such as series and pictures, are made by `tagged`.

Numbers of one series share their last decimal place, so a long series is written as integers with one exponent:
`-12345e-3` is a JSON number like any other, and such an answer is little more than half as long as with all digits.
"""

import csv
import hashlib
import io
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from datetime import datetime
from math import floor, log10
from threading import Lock
from typing import Annotated, Any, Literal, TypeVar, get_args

import numpy as np
import orjson
from fastapi import Depends, Query, Request, Response
from fastapi.responses import StreamingResponse
from fastapi.routing import APIRoute
from pydantic import BaseModel

from core.arrays import Vector
from service.http.problems import openapi_responses

M = TypeVar("M", bound=BaseModel)

Format = Annotated[
    Literal["json", "csv"] | None,
    Query(description="Form of the answer; without it the header Accept decides, and JSON is the default."),
]
OPTIONS = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_UTC_Z
CSV_EXAMPLE = "A header line with the names of the columns, then one line a row; an empty field is null. A text "
"that a spreadsheet would take for a formula begins with an apostrophe."
FORMULAS = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of a text that a spreadsheet would take for a formula and run."""
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
        """The body with that tag, if it is still kept."""
        with self._lock:
            if etag in self._bodies:
                self._bodies.move_to_end(etag)
            return self._bodies.get(etag)

    def keep(self, etag: str, body: bytes) -> None:
        """Keep a body; those used longest ago make room for it."""
        with self._lock:
            self._size += len(body) - len(self._bodies.pop(etag, b""))
            self._bodies[etag] = body
            while self._size > self._most:
                self._size -= len(self._bodies.popitem(last=False)[1])


class TaggedRoute(APIRoute):
    """A route whose endpoint returns a model: JSON or, for a table, CSV on request, with an entity tag."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler of the framework, with its response tagged."""
        handle = super().get_route_handler()
        is_table = "text/csv" in self.responses.get(200, {}).get("content", {})

        async def answered(request: Request) -> Response:
            response = await handle(request)
            if request.method != "GET" or response.status_code != 200 or "etag" in response.headers:
                return response
            if isinstance(response, StreamingResponse):
                return response
            if not is_table:
                return written(request, bytes(response.body), "application/json")
            return _table(request, self.response_model, bytes(response.body))

        return answered


def rows_of(model: type[M], rows: Iterable[Sequence[Any]], following: str | None = None, **context: object) -> M:
    """A page of a table.

    Args:
        model: the answer's model, with `items` and `next`.
        rows: values in the order of the fields of the items' model.
        following: the cursor of the next page; None after the last.
        context: the other fields of the model.
    """
    columns = _columns(model)
    return model.model_validate(
        context | {"items": [dict(zip(columns, row, strict=True)) for row in rows], "next": following}
    )


def _columns(model: type[BaseModel]) -> tuple[str, ...]:
    row: type[BaseModel] = get_args(model.model_fields["items"].annotation)[0]
    return tuple(row.model_fields)


def _table(request: Request, model: type[BaseModel], body: bytes) -> Response:
    """A table as JSON or CSV; the header Link names the next page."""
    is_csv = wants_csv(request, request.query_params.get("format"))
    content: dict[str, Any] = orjson.loads(body)
    headers = _link(request, content["next"])
    if not is_csv:
        return written(request, body, "application/json", headers=headers)
    return written(
        request, _csv(_columns(model), [row.values() for row in content["items"]]), "text/csv", headers=headers
    )


def _link(request: Request, following: str | None) -> dict[str, str]:
    url = request.url.include_query_params(cursor=following)  # relative: the Host in it is the client's choice
    return {} if following is None else {"Link": f'<{url.path}?{url.query}>; rel="next"'}


def wants_csv(request: Request, format: str | None) -> bool:
    """Whether the client requests CSV."""
    if format is not None:
        return format == "csv"
    accepted = [part.split(";")[0].strip() for part in request.headers.get("accept", "").split(",")]
    return "text/csv" in accepted and "application/json" not in accepted


def tag(*identity: object) -> str:
    """The entity tag of an answer that these values determine."""
    return f'"{hashlib.sha256(repr(identity).encode()).hexdigest()[:32]}"'


def is_known(request: Request, etag: str) -> bool:
    """Whether the client has this answer already."""
    known = request.headers.get("if-none-match", "")
    return known == "*" or etag in (part.strip().removeprefix("W/") for part in known.split(","))


def tagged(
    request: Request,
    etag: str,
    make: Callable[[], bytes],
    media_type: str,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """The answer of that tag, or 304; `make` is called only for a client that does not have it."""
    if is_known(request, etag):
        return unchanged(etag)
    return Response(make(), headers=_caching(etag) | dict(headers or {}), media_type=media_type)


def written(
    request: Request, body: bytes, media_type: str, etag: str | None = None, headers: Mapping[str, str] | None = None
) -> Response:
    """The answer, or 304; without `etag` the tag is that of its bytes."""
    return tagged(request, etag or tag(body), lambda: body, media_type, headers)


def unchanged(etag: str) -> Response:
    """304: the answer that the client has is still right."""
    return Response(status_code=304, headers=_caching(etag))


def _caching(etag: str) -> dict[str, str]:
    """Kept by the client only, and requested again every time: a new analysis shows at once."""
    return {"ETag": etag, "Cache-Control": "private, no-cache", "Vary": "Accept, Authorization, Cookie, X-API-Key"}


def document(request: Request, content: BaseModel) -> Response:
    """A value as JSON."""
    return written(request, orjson.dumps(content.model_dump(), option=OPTIONS), "application/json")


def table(
    request: Request,
    format: str | None,
    columns: Sequence[str],
    rows: Sequence[Sequence[Any]],
    following: str | None,
    **context: object,
) -> Response:
    """A page of a table: objects in JSON, lines in CSV; both name the next page in the header Link."""
    headers = _link(request, following)
    if wants_csv(request, format):
        return written(request, _csv(columns, rows), "text/csv", headers=headers)
    items = [dict(zip(columns, row, strict=True)) for row in rows]
    content = context | {"items": items, "next": following}
    return written(request, orjson.dumps(content, option=OPTIONS), "application/json", headers=headers)


def _csv(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue().encode()


def _cell(value: object) -> object:
    """Times with a Z, lists with semicolons, objects as JSON; an apostrophe before what a spreadsheet would run."""
    if isinstance(value, datetime):
        return value.isoformat().replace("+00:00", "Z")
    text = "; ".join(map(str, value)) if isinstance(value, list) else value
    text = orjson.dumps(value).decode() if isinstance(value, dict) else text
    return f"'{text}" if isinstance(text, str) and text.startswith(FORMULAS) else text


def series_lines(columns: Mapping[str, Vector]) -> bytes:
    """Series of one length as CSV.

    orjson writes an array of numbers some 50 times faster than csv, and its rows need only other brackets.
    """
    rows = orjson.dumps(np.ascontiguousarray(np.column_stack(list(columns.values()))), option=OPTIONS)
    body = rows[2:-2].replace(b"],[", b"\r\n").replace(b"null", b"")
    return ",".join(columns).encode() + b"\r\n" + body + b"\r\n"


def _declared(format: Format = None) -> None:
    """The parameter `format` of a table."""


def responses(model: type[BaseModel], *statuses: int, csv: bool = False) -> dict[str, Any]:
    """The OpenAPI description of an operation's answers: its content, 304, and each problem."""
    content: dict[str, Any] = {"text/csv": {"schema": {"type": "string", "description": CSV_EXAMPLE}}} if csv else {}
    tagged = {"ETag": {"description": "Tag of this answer, for If-None-Match.", "schema": {"type": "string"}}}
    special = {
        200: {"headers": tagged, "content": content},
        304: {"description": "Unchanged since the tag in If-None-Match."},
    }
    return {"response_model": model, "responses": special | openapi_responses(401, 403, 422, *statuses)}


def table_responses(model: type[BaseModel], *statuses: int) -> dict[str, Any]:
    """The same for a table, which comes as JSON or CSV by the parameter `format`."""
    return responses(model, *statuses, csv=True) | {"dependencies": [Depends(_declared)]}


DIGITS = 8
"""Digits of a series' peak; a 24-bit digitizer gives seven."""


def rounded(values: Vector) -> Vector:
    """(n,) the numbers that `series_json` writes, unit as given; NaN stays."""
    return _floats(*_integers(values)) if _is_regular(values) else values


def series_json(values: Vector) -> orjson.Fragment:
    """A series as a JSON array, null where it is not finite.

    Args:
        values: (n,) any unit.
    """
    if not _is_regular(values):
        return orjson.Fragment(orjson.dumps(np.ascontiguousarray(values), option=orjson.OPT_SERIALIZE_NUMPY))
    integers, exponent = _integers(values)
    last = b"e%d" % exponent if exponent else b""
    body = orjson.dumps(integers, option=orjson.OPT_SERIALIZE_NUMPY)
    return orjson.Fragment(body[:-1].replace(b",", last + b",") + last + b"]")


def _is_regular(values: Vector) -> bool:
    """Whether one exponent suits all: finite, and neither empty nor all zero."""
    peak = float(np.abs(values).max(initial=0.0))
    return 1e-14 < peak < 1e29  # false for NaN; within, every power of ten that is needed is exact


def _integers(values: Vector) -> tuple[np.ndarray[tuple[int], np.dtype[np.int32]], int]:
    exponent = floor(log10(float(np.abs(values).max()))) + 1 - DIGITS
    scaled = values * 10.0**-exponent if exponent < 0 else values / 10.0**exponent
    return np.rint(scaled).astype(np.int32), exponent


def _floats(integers: np.ndarray[tuple[int], np.dtype[np.int32]], exponent: int) -> Vector:
    """Nearest to the decimal number, as every reader of the JSON number gets it."""
    power = float(10 ** abs(exponent))
    return integers.astype(float) / power if exponent < 0 else integers.astype(float) * power
