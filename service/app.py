"""The web application, assembled."""

from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import timedelta
from functools import cache
from threading import Event as Signal
from typing import Any

from fastapi import APIRouter, Depends, FastAPI, Request
from fastapi.responses import JSONResponse
from fastapi.staticfiles import StaticFiles
from prometheus_client import CollectorRegistry
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.routing import BaseRoute

from service import tracing
from service.access import api as access_api, auth, pages as access_pages
from service.access.api import keys as key_api, links as link_api
from service.access.callers import Callers
from service.access.logins import Attempts
from service.access.pages import keys as key_pages, links as link_pages, sign_in
from service.access.roles import Caller
from service.alerts import api as alert_api, pages as alert_pages
from service.analyses import pages as analysis_pages
from service.analyses.api import event_pictures, events, pictures, series as analysis_series
from service.buildings import api as building_api, pages as building_pages
from service.db.encryption import SecretKeyError
from service.db.sessions import NulError, reading, sessions
from service.drift import api as drift_api, pages as drift_pages
from service.health import api as health_api
from service.health.metrics import Measured
from service.http import api_page, error_pages, languages, libraries, problems
from service.http.guard import Guard
from service.http.rendering import FOLDER
from service.http.request_capture import RequestCapture
from service.http.request_ids import RequestIds
from service.http.responses import Answers
from service.jobs import api as job_api
from service.models.api import comparisons, effects, kept_effects, models
from service.models.pages import (
    effects as effect_pages,
    forecasts as forecast_pages,
    models as model_pages,
    pictures as model_pictures,
    results as result_pages,
    work as work_pages,
)
from service.notify import pages as notify_pages
from service.notify.api import messages, recipients
from service.records.api import fdsn, recordings
from service.reports import api as report_api
from service.schema import Problem
from service.settings import Settings
from service.user_effects import add_user_effects
from service.version import VERSION

DESCRIPTION = """\
Structural health monitoring for base-isolated buildings. Values are in SI units and times in UTC, unless a name says
otherwise; what is missing is null, with its reason beside it. Tables and series are answered as JSON or CSV
(`Accept: text/csv` or `format=csv`); long series can be thinned by `points`. Every error is a problem document
(RFC 9457). A key goes into `Authorization: Bearer KEY` or `X-API-Key: KEY`.
"""
TAGS = [
    {"name": "buildings", "description": "Buildings, and what is followed over the years."},
    {"name": "events", "description": "One earthquake at one building."},
    {"name": "series", "description": "Long series of an event."},
    {"name": "reports", "description": "Reports for paper."},
    {"name": "drift", "description": "What changed over the years, against what was expected."},
    {"name": "models", "description": "Models of the isolation layer, compared with measurements."},
    {"name": "alerts", "description": "What people should know, and what was done about it."},
    {"name": "messages", "description": "Recipients of a building's messages, the messages, and their deliveries."},
    {"name": "operations", "description": "Sources, jobs and the service's health."},
]
COMPRESSED = 1024
"""Bytes from which on an answer is compressed for clients that accept it."""
DENSE = (*DEFAULT_EXCLUDED_CONTENT_TYPES, fdsn.MINISEED)
"""Media types that are compressed already, or streams."""
SECURITY = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "An API key."},
    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key", "description": "An API key."},
}


def create(settings: Settings, visitor: Caller | None = None) -> FastAPI:
    """The application, on a database whose tables exist.

    Args:
        settings: the service's settings.
        visitor: the caller that programs and browsers on this machine count as until the first key is made; for
            demonstrations, whose data are simulated. None: every caller needs a key or a session.
    """
    add_user_effects(settings.effects_folder)
    app = FastAPI(
        title="Menshin",
        version=VERSION,
        description=DESCRIPTION,
        openapi_tags=TAGS,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        lifespan=lifespan,
    )
    app.state.settings = settings
    app.state.sessions = sessions(settings.database_url)
    app.state.reading = reading(app.state.sessions)
    app.state.answers = Answers()
    app.state.visitor = visitor
    idle, lifetime = (timedelta(seconds=one) for one in (settings.login.idle_timeout, settings.login.lifetime))
    app.state.callers = Callers(app.state.sessions, idle, lifetime, oidc=settings.oidc)
    app.state.provider = sign_in.provider_of(settings)
    app.state.attempts = Attempts()
    app.state.questions = Counter()
    app.state.ending = Signal()
    app.state.unready_since = {}  # check name to time
    app.state.durations = CollectorRegistry()
    app.add_middleware(GZipMiddleware, minimum_size=COMPRESSED, compresslevel=5, exclude_content_types=DENSE)
    app.add_middleware(RequestCapture)
    app.add_middleware(Guard, ending=app.state.ending, refusal=error_pages.service_problem)
    app.add_middleware(Measured, registry=app.state.durations)
    app.add_middleware(languages.Languages)
    app.add_middleware(RequestIds)
    tracing.trace_requests(app)
    problems.install(app)
    app.add_exception_handler(NulError, problems.text_problem)
    app.add_exception_handler(SecretKeyError, problems.secret_key_problem)
    error_pages.install(app)
    app.router.routes.extend(_routes())
    app.mount("/static", StaticFiles(directory=FOLDER / "static"))
    app.add_api_route("/openapi.json", openapi_document, include_in_schema=False)
    app.openapi = lambda: openapi(app)  # type: ignore[method-assign]  # FastAPI's documented way to extend it
    return app


@cache
def _routes() -> list[BaseRoute]:
    """Routes of the API and the pages, which are read once per process: several applications share them."""
    every = APIRouter()
    api = APIRouter(prefix="/api/v1", dependencies=[Depends(auth.viewer)])
    message_rooms = (alert_api, access_api, key_api, link_api, recipients, messages)
    for module in (
        building_api,
        events,
        report_api,
        analysis_series,
        drift_api,
        *message_rooms,
        job_api,
        recordings,
    ):
        api.include_router(module.router)
    for module in (effects, kept_effects, models, comparisons):
        api.include_router(module.router, dependencies=[Depends(kept_effects.known)])
    every.include_router(api)
    every.include_router(recordings.pages)
    every.include_router(fdsn.router, dependencies=[Depends(auth.viewer)])
    pages = (
        api_page,
        building_pages,
        analysis_pages,
        drift_pages,
        alert_pages,
        notify_pages,
        model_pages,
        result_pages,
        forecast_pages,
        work_pages,
        effect_pages,
        pictures,
        event_pictures,
        model_pictures,
        access_pages,
        sign_in,
        link_pages,
        key_pages,
    )
    for module in (*pages, health_api):  # each checks access by itself
        every.include_router(module.router)
    every.include_router(languages.router)
    every.include_router(libraries.router)
    return every.routes


@asynccontextmanager
async def lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Close the database connections when the application ends."""
    yield
    await app.state.callers.settle()
    app.state.sessions.kw["bind"].dispose()


async def openapi_document(request: Request) -> JSONResponse:
    """The OpenAPI document."""
    return JSONResponse(request.app.openapi())


def openapi(app: FastAPI) -> dict[str, Any]:
    """FastAPI's document with the problem's schema and the two ways to send a key."""
    if app.openapi_schema is None:
        document = FastAPI.openapi(app)
        components = document.setdefault("components", {})
        components["schemas"]["Problem"] = Problem.model_json_schema()
        components["securitySchemes"] = SECURITY
        document["security"] = [{name: []} for name in SECURITY]
        for operation in (one for path in document["paths"].values() for one in path.values()):
            everywhere = problems.openapi_responses(429, *([413] if "requestBody" in operation else []))
            for status, answer in everywhere.items():
                operation["responses"].setdefault(str(status), answer)
        app.openapi_schema = document
    return app.openapi_schema
