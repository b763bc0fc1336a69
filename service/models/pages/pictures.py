"""The pictures of the models' pages, drawn on the server."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from service.access.auth import viewer
from service.db.blobs import decode_history
from service.http.parameters import LARGEST, Reading
from service.http.rendering import SVG, picture
from service.http.responses import Tagged, TaggedRoute
from service.models import answers, charts, queries
from service.reports.charts import Picture

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)], route_class=TaggedRoute)


@router.get("/model-loop.svg")
def loop(sessions: Reading, comparison: Annotated[int, Query(ge=1, le=LARGEST)]) -> Tagged:
    """The model's force beside the estimated one, over displacement."""
    with sessions() as session:
        found = queries.comparison(session, comparison)
        measured = queries.measured(session, found.analysis_id, found.direction)
        title = f"{found.event.start:%Y-%m-%d %H:%M:%S} UTC, direction {found.direction}"

    def draw() -> Picture:
        return charts.loops(
            displacement=decode_history(measured.displacement),
            measured=decode_history(measured.force),
            modelled=decode_history(found.force),
            title=title,
        )

    return picture(draw, "model-loop", found.id, found.created_at)


@router.get("/model-trend.svg")
def trend(sessions: Reading, model: Annotated[int, Query(ge=1, le=LARGEST)]) -> Tagged:
    """The model's error beyond noise, event by event."""
    with sessions() as session:
        compared = queries.latest_comparisons(session, [model])[model]
    identity = [(one.id, one.created_at) for one, _ in compared]
    return picture(lambda: charts.trend(answers.judged(compared)), "model-trend", model, identity)


@router.get("/model-diagnosis.svg")
def of_diagnosis(sessions: Reading, number: Annotated[int, Query(ge=1, le=LARGEST)]) -> Tagged:
    """A picture as its diagnosis drew it."""
    with sessions() as session:
        svg = queries.picture(session, number)
    return Tagged(svg.encode, SVG, "model-diagnosis", number)
