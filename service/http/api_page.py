"""The API for people: every operation as text, and Swagger UI in its place where JavaScript runs."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from types import MappingProxyType
from typing import Any

from fastapi import APIRouter, Depends, Request, Response
from markupsafe import Markup, escape

from service.access.pages import reader
from service.http.rendering import POLICY, TEMPLATES, page

PICTURES = "img-src 'self'"
SWAGGER_POLICY = MappingProxyType(
    {name: value.replace(PICTURES, f"{PICTURES} data:") for name, value in POLICY.items()}
)
"""Admits the icons in Swagger UI's stylesheet."""

router = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation of the OpenAPI document."""

    method: str
    path: str
    content: dict[str, Any]

    @property
    def tag(self) -> str:
        """Name of its group."""
        return str(self.content["tags"][0]) if self.content.get("tags") else "operations"


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The OpenAPI document for people, without a CDN."""
    document = request.app.openapi()
    order = {tag["name"]: number for number, tag in enumerate(document["tags"])}
    operations = sorted(_operations(document), key=lambda one: order[one.tag])
    groups = [(document["tags"][order[tag]], list(own)) for tag, own in groupby(operations, key=lambda one: one.tag)]
    return page(request, "docs", policy=SWAGGER_POLICY, document=document, groups=groups)


def _operations(document: dict[str, Any]) -> Iterator[Operation]:
    for path, methods in document["paths"].items():
        for method, content in methods.items():
            yield Operation(method.upper(), path, content)


def with_code(text: str) -> Markup:
    """A text whose parts in backticks are set as code."""
    return Markup(re.sub(r"`+([^`]+)`+", r"<code>\1</code>", str(escape(text))))


TEMPLATES.env.filters["with_code"] = with_code
