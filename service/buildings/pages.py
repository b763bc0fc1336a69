"""The first page: buildings, the last event and its results."""

from dataclasses import dataclass
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from service.access.pages import reader
from service.alerts import queries as alert_queries
from service.analyses import mode_tracks
from service.analyses.mode_tracks import TrackedMode
from service.analyses.pages import MODES, View, viewed
from service.buildings import queries
from service.buildings.tables import Building
from service.db.select import Span
from service.http.paging import AfterCode, next_code
from service.http.parameters import Reading
from service.http.rendering import page
from service.models import answers as model_answers, queries as model_queries
from service.models.schema import Trend
from service.models.tables import ModelVersion
from service.records import queries as record_queries
from service.verdict import reading

LISTED = 50
"""Buildings, and troubles, of one page."""

router = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])
BuildingCode = Annotated[str | None, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]


@router.get("/")
def home(request: Request, sessions: Reading, building: BuildingCode = None, cursor: AfterCode = None) -> Response:
    """The buildings, and the last event of the named building, or of the one shaken last."""
    with sessions() as session:
        rows = queries.buildings(session, cursor, LISTED)
        numbers = [row.Building.id for row in rows]
        shown = queries.building(session, building)[0] if building else queries.shaken_last(session)
        views = last_events(session, shown) if shown else []
        models = failing_models(session, shown) if shown else []
        open_now = alert_queries.open_counts(session, numbers)
        return page(
            request,
            "home",
            buildings=rows,
            open_alerts=open_now,
            cursor=cursor,
            following=next_code([row.Building.code for row in rows], LISTED),
            verdicts=reading.of_buildings(session, select(Building.id).where(Building.id.in_(numbers))),
            verdict_on=reading.of_building(session, shown) if shown else None,
            shown=shown and shown.code,
            views=views,
            modes=MODES,
            models=models,
            troubles=troubles(session),
        )


@dataclass(frozen=True, slots=True)
class Trouble:
    """Reasons why records of a building do not arrive, or could not be used."""

    code: str
    since: datetime | None
    """Time since which its monitoring server has been failing."""
    error: str | None
    rejected: int
    """Files that could not be used."""


def troubles(session: Session) -> list[Trouble]:
    """Buildings whose monitoring server fails, or that have rejected files, by code: the first so many."""
    rejected = record_queries.rejected_counts(session)
    failing = {building.id: state for building, state in queries.failing_sources(session)}
    rows = queries.of_numbers(session, {*rejected, *failing}, LISTED)
    return [
        Trouble(
            code=one.code,
            since=failing[one.id].failing_since if one.id in failing else None,
            error=failing[one.id].error if one.id in failing else None,
            rejected=rejected.get(one.id, 0),
        )
        for one in rows
    ]


def failing_models(session: Session, building: Building) -> list[tuple[ModelVersion, Trend]]:
    """The building's current models that miss its latest events."""
    in_force = model_queries.current_versions(session, building.id)
    compared = model_queries.latest_comparisons(session, [model.id for model in in_force])
    trends = [(model, model_answers.trend(model.id, compared[model.id])) for model in in_force]
    return [(model, trend) for model, trend in trends if trend.finding is not None]


def last_events(session: Session, building: Building) -> list[View]:
    """The last event, and where it has no result the last one that has."""
    last = [viewed(session, *pair) for pair in record_queries.events(session, building.id, Span(), None, None, limit=1)]
    if any(view.results for view in last):
        return last
    return last + [viewed(session, *pair) for pair in record_queries.last_analysed(session, building.id)]


@router.get("/alerts")
def all_alerts() -> Response:
    """The alerts of all buildings are on the first page."""
    return RedirectResponse("/", 303)


@router.get("/modes")
def modes(
    request: Request, sessions: Reading, building: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
) -> Response:
    """The modes of a building over its events."""
    with sessions() as session:
        made, _ = queries.building(session, building)
        directions = [_modes_of_direction(session, made, direction) for direction in mode_tracks.DIRECTIONS]
        return page(request, "modes", building=made, directions=[one for one in directions if one[2]])


def _modes_of_direction(session: Session, building: Building, direction: str) -> tuple[str, list[TrackedMode], int]:
    """A direction, its established modes, and the number of events that showed any."""
    modes = mode_tracks.tracked_modes(session, building.id, Span(), direction)
    events = {sighting.event for mode in modes for sighting in mode.sightings}
    return direction, [mode for mode in modes if mode.is_established], len(events)


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The OpenAPI document for people, without a CDN."""
    return page(request, "docs", document=request.app.openapi())
