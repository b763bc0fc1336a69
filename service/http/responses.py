"""How an answer is written: JSON or CSV, tagged so that nobody fetches it twice."""

import csv
import hashlib
import io
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from datetime import datetime
from threading import Lock
from typing import Annotated, Any, Literal

import numpy as np
import orjson
from fastapi import Query, Request, Response
from pydantic import BaseModel

from core.arrays import Vector
from service.errors import documented

Format = Annotated[
    Literal["json", "csv"] | None,
    Query(description="Form of the answer; without it the header Accept decides, and JSON is the default."),
]
OPTIONS = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_UTC_Z
CSV_EXAMPLE = "A header line with the names of the columns, then one line a row; an empty field is null. A text "
"that a spreadsheet would take for a formula begins with an apostrophe."

KEPT = 32 * 2**20
"""Bytes of written answers that a process keeps."""


class Answers:
    """The answers asked for last, by their tag: what results determine never changes. Threads may share it."""

    def __init__(self, most: int = KEPT) -> None:
        self._most = most
        self._size = 0
        self._bodies: OrderedDict[str, bytes] = OrderedDict()
        self._lock = Lock()

    def find(self, etag: str) -> bytes | None:
        """The answer of that tag, if it is still kept."""
        with self._lock:
            if etag in self._bodies:
                self._bodies.move_to_end(etag)
            return self._bodies.get(etag)

    def keep(self, etag: str, body: bytes) -> None:
        """Keep this one too; those that nobody has asked for the longest make room for it."""
        with self._lock:
            self._size += len(body) - len(self._bodies.pop(etag, b""))
            self._bodies[etag] = body
            while self._size > self._most:
                self._size -= len(self._bodies.popitem(last=False)[1])


def wants_csv(request: Request, format: str | None) -> bool:
    """Whether CSV was asked for."""
    if format is not None:
        return format == "csv"
    accepted = [part.split(";")[0].strip() for part in request.headers.get("accept", "").split(",")]
    return "text/csv" in accepted and "application/json" not in accepted


def tag(*identity: object) -> str:
    """The entity tag of an answer that these values determine."""
    return f'"{hashlib.sha256(repr(identity).encode()).hexdigest()[:32]}"'


def is_known(request: Request, etag: str) -> bool:
    """Whether the asker holds this answer already."""
    known = request.headers.get("if-none-match", "")
    return known == "*" or etag in (part.strip().removeprefix("W/") for part in known.split(","))


def unchanged(etag: str) -> Response:
    """304: the answer that the asker holds is still right."""
    return Response(status_code=304, headers=_caching(etag))


def written(
    request: Request, body: bytes, media_type: str, etag: str | None = None, headers: Mapping[str, str] | None = None
) -> Response:
    """The answer, or 304; its tag is that of its bytes unless what determines them is cheaper to tell."""
    etag = etag or tag(body)
    if is_known(request, etag):
        return unchanged(etag)
    return Response(body, headers=_caching(etag) | dict(headers or {}), media_type=media_type)


def _caching(etag: str) -> dict[str, str]:
    """Kept by the asker only, and asked for again every time: a new analysis shows at once."""
    return {"ETag": etag, "Cache-Control": "private, no-cache", "Vary": "Accept, Authorization, Cookie, X-API-Key"}


def document(request: Request, content: BaseModel, headers: Mapping[str, str] | None = None) -> Response:
    """A value as JSON."""
    return written(request, orjson.dumps(content.model_dump(), option=OPTIONS), "application/json", headers=headers)


def table(
    request: Request,
    format: str | None,
    columns: Sequence[str],
    rows: Sequence[Sequence[Any]],
    following: str | None,
    **context: object,
) -> Response:
    """A page of a table: objects in JSON, lines in CSV; both name the next page in the header Link."""
    url = request.url.include_query_params(cursor=following)  # the Host in it is whatever the client likes
    headers = {} if following is None else {"Link": f'<{url.path}?{url.query}>; rel="next"'}
    if wants_csv(request, format):
        return written(request, _lines(columns, rows), "text/csv", headers=headers)
    items = [dict(zip(columns, row, strict=True)) for row in rows]
    content = context | {"items": items, "next": following}
    return written(request, orjson.dumps(content, option=OPTIONS), "application/json", headers=headers)


def _lines(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue().encode()


FORMULAS = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of a text that a spreadsheet would take for a formula and run."""


def _cell(value: object) -> object:
    """Times with a Z, lists with semicolons between; an apostrophe before a text that a spreadsheet would run."""
    if isinstance(value, datetime):
        return value.isoformat().replace("+00:00", "Z")
    text = "; ".join(map(str, value)) if isinstance(value, list) else value
    return f"'{text}" if isinstance(text, str) and text.startswith(FORMULAS) else text


def series_lines(columns: Mapping[str, Vector]) -> bytes:
    """Series of one length as CSV.

    orjson writes an array of numbers some 50 times faster than csv, and its rows need only other brackets.
    """
    rows = orjson.dumps(np.ascontiguousarray(np.column_stack(list(columns.values()))), option=OPTIONS)
    body = rows[2:-2].replace(b"],[", b"\r\n").replace(b"null", b"")
    return ",".join(columns).encode() + b"\r\n" + body + b"\r\n"


def responses(model: type[BaseModel], *statuses: int, csv: bool = False) -> dict[str, Any]:
    """What the OpenAPI document says of an operation's answers: its content, 304, and each problem."""
    content: dict[str, Any] = {"text/csv": {"schema": {"type": "string", "description": CSV_EXAMPLE}}} if csv else {}
    tagged = {"ETag": {"description": "Tag of this answer, for If-None-Match.", "schema": {"type": "string"}}}
    special = {
        200: {"headers": tagged, "content": content},
        304: {"description": "Unchanged since the tag in If-None-Match."},
    }
    return {"response_model": model, "responses": special | documented(401, 403, 422, *statuses)}
