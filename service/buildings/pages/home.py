"""The first page: the buildings, the worst level first; and the pages that are about no single building."""

from collections import Counter
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from service.access.pages import reader
from service.analyses import mode_tracks
from service.analyses.mode_tracks import TrackedMode
from service.buildings import queries
from service.buildings.pages.map import LINES, drawn, read_area
from service.buildings.pages.summary import summaries
from service.buildings.tables import Building
from service.db.select import Span
from service.http.parameters import Reading
from service.http.rendering import page
from service.verdict import levels
from service.verdict.checks import LEVELS, Level
from service.verdict.levels import Selection

LISTED = 50
"""Buildings of one page."""
FEWEST_SEARCHED = 10
"""Buildings from which on the page has a search form."""

router = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])
BuildingCode = Annotated[str | None, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
OfLevel = Annotated[Level | None, Query()]
Text = Annotated[str, Query(max_length=100)]
OfArea = Annotated[str | None, Query(pattern=LINES)]
Number = Annotated[int, Query(ge=1, le=100_000)]


@router.get("/")
def home(
    request: Request,
    sessions: Reading,
    building: BuildingCode = None,
    level: OfLevel = None,
    find: Text = "",
    area: OfArea = None,
    number: Number = 1,
) -> Response:
    """The buildings, the worst level first, `number` being that of the page; `building` leads to its own page."""
    if building is not None:
        return RedirectResponse(f"/buildings/{building}", 303)
    wanted = Selection(level=level, text=find.strip(), area=(area and read_area(area)) or None)
    with sessions() as session:
        chosen = levels.ranked(session, wanted, (number - 1) * LISTED, LISTED)
        lines = summaries(session, chosen)
        others, shown = levels.tally(session, wanted, chosen), Counter(one.level for one in lines)
        every, found = shown + others.every, shown + others.found
        return page(
            request,
            "home",
            buildings=lines,
            counts=[(one, every[one]) for one in LEVELS],
            total=every.total(),
            found=found.total(),
            wanted=wanted,
            area=area,
            number=number,
            listed=LISTED,
            fewest=FEWEST_SEARCHED,
            map=drawn(session, wanted, others.extent, lines),
        )


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
    modes = mode_tracks.tracked_modes(session, building.id, Span(), direction, mode_tracks.SHOWN)
    events = {sighting.event for mode in modes for sighting in mode.sightings}
    return direction, [mode for mode in modes if mode.is_established], len(events)
