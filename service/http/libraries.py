"""Libraries of pages: files from installed wheels, at addresses with their versions, which browsers keep for a year.

Vega-Embed draws live charts (BSD-3-Clause, from the wheel of vl-convert-python). Swagger UI shows the API (Apache-2.0,
from the wheel of fastapi-offline). A new version of the wheel is a new version of its file.
"""

import gzip
from collections.abc import Callable, Mapping
from functools import cache, partial
from importlib.metadata import distribution, version
from pathlib import Path as File
from types import MappingProxyType

import vl_convert
from fastapi import APIRouter, Request, Response

from service.errors import NotFoundError
from service.http.responses import is_known, tag

FOLDER = "/static/libraries"
NOTICE = "/* {}, {}; from the Python wheel {} {} */\n"

router = APIRouter(include_in_schema=False)


def _vega() -> bytes:
    notice = NOTICE.format(
        f"Vega-Embed {vl_convert.get_vega_embed_version()}, Vega and Vega-Lite", "BSD-3-Clause", *_VEGA
    )
    return (notice + vl_convert.javascript_bundle(snippet="window.vegaEmbed = vegaEmbed;")).encode()


def _swagger(ending: str) -> bytes:
    wheel = distribution("fastapi-offline")
    content = File(str(wheel.locate_file(f"fastapi_offline/static/{ending}"))).read_bytes()
    return NOTICE.format("Swagger UI", "Apache-2.0", *_SWAGGER).encode() + content


_VEGA = "vl-convert-python", version("vl-convert-python")
_SWAGGER = "fastapi-offline", version("fastapi-offline")
FILES: Mapping[str, tuple[str, Callable[[], bytes]]] = MappingProxyType(
    {
        f"vega-embed-{_VEGA[1]}.js": ("text/javascript", _vega),
        f"swagger-ui-{_SWAGGER[1]}.js": ("text/javascript", partial(_swagger, "swagger-ui-bundle.js")),
        f"swagger-ui-{_SWAGGER[1]}.css": ("text/css", partial(_swagger, "swagger-ui.css")),
    }
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
