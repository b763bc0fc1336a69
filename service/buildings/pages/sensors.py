"""Page of one more sensor: by how much an accelerometer at each level would narrow the force and the modes."""

from datetime import UTC, datetime
from typing import Annotated

import altair as alt
from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict
from starlette.responses import RedirectResponse

from service.access.auth import Caller, engineer, viewer
from service.access.pages import reader
from service.analyses import added_sensors
from service.analyses.added_sensors import AddedSensorsDocument
from service.buildings.pages.building import shown_building
from service.buildings.store import described, zone
from service.documents.charts import BLUE, CONFIG, GREY, KN, brief, shown_on_hover, values
from service.errors import NotFoundError
from service.http.forms import Posted, answered, posted
from service.http.parameters import LARGEST, Code, JobId, Reading, Writing
from service.http.rendering import As, page, picture
from service.http.responses import TaggedRoute

MODES = 3
"""Modes that the page lists."""
WIDTH, STEP = 400, 24
"""Pixels: of the picture, and of a level in it."""
TODAY, WITH = "today", "with one more sensor"
FORCE = "standard deviation of the force (kN)"

router = APIRouter(include_in_schema=False)
charts = APIRouter(prefix="/charts", dependencies=[Depends(viewer)], route_class=TaggedRoute)


class SensorsForm(BaseModel):
    """The form, which has nothing to fill in."""

    model_config = ConfigDict(extra="ignore")


@router.post("/buildings/{code}/added-sensors")
def request(
    request: Request,
    code: Code,
    sessions: Writing,
    by: Annotated[Caller, Depends(engineer)],
    form: Annotated[Posted[SensorsForm], Depends(posted(SensorsForm))],
) -> Response:
    """Compute where one more accelerometer would help most, and show the progress."""

    def act(_: SensorsForm) -> Response:
        with sessions.begin() as session:
            number = added_sensors.request(session, code, None, by.name, datetime.now(UTC)).id
        return RedirectResponse(f"/jobs/{number}", 303)

    return answered("sensors", form, act, lambda why: shown_building(request, code, sessions, by, why))


@router.get("/sensors/{job_id}")
def of_job(request: Request, job_id: JobId, sessions: Reading, _: Annotated[Caller, Depends(reader)]) -> Response:
    """The levels without an accelerometer, that which narrows the force most first, in each direction."""
    with sessions() as session:
        job, found = added_sensors.found(session, job_id)
        if job.building is None:
            raise NotFoundError("comparison of new sensors", job_id)
        return page(
            request,
            "sensors",
            building=job.building,
            zone=zone(session, job.building),
            job=job,
            found=found,
            directions=[(today, _rows(found, today.direction), today.frequency[:MODES]) for today in found.today],
            modes=MODES,
        )


def _rows(found: AddedSensorsDocument, direction: str) -> list[added_sensors.SensorOut]:
    return [one for one in found.sensors if one.direction == direction]


@charts.get("/added-sensors.{form}")
def chart(
    wanted: As,
    sessions: Reading,
    job: Annotated[int, Query(ge=1, le=LARGEST)],
    direction: Annotated[str, Query(pattern="^[xy]$")],
) -> Response:
    """Standard deviation of the force with one more accelerometer at each level, and today's."""
    with sessions() as session:
        stored, found = added_sensors.found(session, job)
        if stored.building is None:
            raise NotFoundError("comparison of new sensors", job)
        levels = [floor.name for floor in described(session, stored.building).description.floors]
    rows, today = _rows(found, direction), next((one for one in found.today if one.direction == direction), None)
    if today is None or not rows:
        raise NotFoundError("new sensors of direction", direction)
    known = [level for level in reversed(levels) if any(row.level == level for row in rows)]
    order = known + [row.level for row in rows if row.level not in known]
    drawn = {row.level: row for row in rows}
    now = today.force or 0.0

    def draw() -> alt.LayerChart:
        return narrowed([(level, drawn[level].force or 0.0) for level in order], now)

    return picture(wanted, draw, "added-sensors", job, direction)


def narrowed(levels: list[tuple[str, float]], today: float) -> alt.LayerChart:
    """Standard deviations by level as bars, and today's as a line.

    Args:
        levels: from the top, each with the standard deviation, N.
        today: N.
    """
    rows = [{"level": level, FORCE: brief(force * KN), "today (kN)": brief(today * KN)} for level, force in levels]
    upwards = alt.Y("level:N", title=None, sort=[level for level, _ in levels])
    legend = alt.Legend(title=None, orient="top", symbolType="square", symbolOpacity=1.0, symbolStrokeWidth=0)
    colour = alt.Color("curve:N", scale=alt.Scale(domain=[WITH, TODAY], range=[BLUE, GREY]), legend=legend)
    bars = (
        alt.Chart(values(rows))
        .mark_bar(height=STEP * 0.6)
        .transform_calculate(curve=f"'{WITH}'")
        .encode(
            x=alt.X(f"{FORCE}:Q", title=FORCE),
            y=upwards,
            color=colour,
            tooltip=shown_on_hover("level", FORCE, "today (kN)"),
        )
    )
    line = (
        alt.Chart(values(rows))
        .mark_tick(thickness=3, size=STEP * 0.9)
        .transform_calculate(curve=f"'{TODAY}'")
        .encode(x=alt.X("today (kN):Q", title=FORCE), y=upwards, color=colour)
    )
    return alt.LayerChart(layer=[bars, line], width=WIDTH, height=STEP * len(levels), config=CONFIG)
