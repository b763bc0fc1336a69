"""Libraries of pages: files from installed wheels, at addresses with their versions, which browsers keep for a year.

Vega-Embed draws live charts (BSD-3-Clause, from the wheel of vl-convert-python). A new version of the wheel is a new
version of its file.
"""

import gzip
from collections.abc import Callable, Mapping
from functools import cache
from importlib.metadata import version
from types import MappingProxyType

import vl_convert
from fastapi import APIRouter, Request, Response

from service.errors import NotFoundError
from service.http.responses import is_known, tag

FOLDER = "/static/libraries"
NOTICE = "/* {} {}, {}; from the Python wheel {} {} */\n"

router = APIRouter(include_in_schema=False)


def _vega() -> bytes:
    notice = NOTICE.format(
        "Vega-Embed, Vega and Vega-Lite", vl_convert.get_vega_embed_version(), "BSD-3-Clause", *_VEGA
    )
    return (notice + vl_convert.javascript_bundle(snippet="window.vegaEmbed = vegaEmbed;")).encode()


_VEGA = "vl-convert-python", version("vl-convert-python")
FILES: Mapping[str, tuple[str, Callable[[], bytes]]] = MappingProxyType(
    {f"vega-embed-{_VEGA[1]}.js": ("text/javascript", _vega)}
)
"""Media type and content by name."""


def address(name: str, ending: str) -> str:
    """Address of a library's file of the installed version."""
    return next(f"{FOLDER}/{one}" for one in FILES if one.startswith(f"{name}-") and one.endswith(f".{ending}"))


@router.get(f"{FOLDER}/{{name}}")
def library(request: Request, name: str) -> Response:
    """A library's file, compressed for clients that accept it."""
    if name not in FILES:
        raise NotFoundError("library", name)
    is_compressed = "gzip" in request.headers.get("accept-encoding", "")
    body, etag = _content(name, is_compressed)
    headers = {"ETag": etag, "Cache-Control": "public, max-age=31536000, immutable", "Vary": "Accept-Encoding"}
    if is_known(request, etag):
        return Response(status_code=304, headers=headers)
    if is_compressed:
        headers["Content-Encoding"] = "gzip"
    return Response(body, headers=headers, media_type=FILES[name][0])


@cache
def _content(name: str, is_compressed: bool) -> tuple[bytes, str]:
    """Bytes and entity tag."""
    body = gzip.compress(_content(name, False)[0], mtime=0) if is_compressed else FILES[name][1]()
    return body, tag(body)
