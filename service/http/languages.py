"""The language of each request: its parameter's, the one chosen on a page, or the one that the browser prefers."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from pydantic import BaseModel
from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.auth import is_secure
from service.http.error_pages import form_page
from service.http.forms import Posted, posted
from service.language.choice import Language, accepted, known, speaking

COOKIE = "menshin-language"
SHOWN = ("text/html", "application/pdf", "image/svg+xml")
"""Answers that people read."""
YEAR = 365 * 86400
"""s that a browser keeps the choice."""
MOST = 4096
"""Largest posted form, bytes."""

router = APIRouter(include_in_schema=False)


def chosen(connection: HTTPConnection) -> Language:
    """The language of a request: of its parameter, which a program or a link gives, or of its person."""
    given = known(connection.query_params.get("language")) or known(connection.cookies.get(COOKIE))
    return given or accepted(connection.headers.get("accept-language", ""))


class Languages:
    """The application, which shows each request in its language and says so in the head of pages."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        language = chosen(HTTPConnection(scope))

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if headers.get("content-type", "").startswith(SHOWN):
                    headers["Content-Language"] = language
                    headers.add_vary_header("Accept-Language")
            await send(message)

        with speaking(language):
            await self.app(scope, receive, sent)


class LanguageForm(BaseModel):
    """A language."""

    language: Language


@router.post("/language")
async def choose(
    request: Request, sent: Annotated[Posted[LanguageForm], Depends(posted(LanguageForm, MOST))]
) -> Response:
    """Keep the language in the browser, and show the page again that the form was on."""
    wanted = sent.checked()
    answer = RedirectResponse(form_page(request), 303)
    answer.set_cookie(COOKIE, wanted.language, max_age=YEAR, httponly=True, samesite="lax", secure=is_secure(request))
    return answer
