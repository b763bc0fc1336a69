"""Pictures of the models' pages, drawn on the server: the loop, the error over the events, and those of diagnoses."""

from collections.abc import Sequence
from typing import Annotated

import altair as alt
from fastapi import APIRouter, Depends, Query, Response

from core.arrays import Vector
from service.access.auth import viewer
from service.db.blobs import decode_history
from service.http.parameters import LARGEST, Reading
from service.http.rendering import SVG, As, picture
from service.http.responses import Tagged, TaggedRoute
from service.models import answers, queries
from service.models.trend import RatedError
from service.reports.charts import BLUE, CONFIG, FAINT, GREY, KN, MM, ORANGE, STEP, Picture
from service.reports.thinning import along_path

MEASURED, MODELLED = "measured", "model"

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)], route_class=TaggedRoute)


@router.get("/model-loop.{form}")
def loop(wanted: As, sessions: Reading, comparison: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """The model's force beside the estimated one, over displacement."""
    with sessions() as session:
        stored = queries.comparison(session, comparison)
        measured = queries.measured(session, stored.analysis_id, stored.direction)
        title = f"{stored.event.start:%Y-%m-%d %H:%M:%S} UTC, direction {stored.direction}"

    def draw() -> Picture:
        return loops(
            displacement=decode_history(measured.displacement),
            measured=decode_history(measured.force),
            modelled=decode_history(stored.force),
            title=title,
        )

    return picture(wanted, draw, "model-loop", stored.id, stored.created_at)


@router.get("/model-trend.{form}")
def trend(wanted: As, sessions: Reading, model: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """The model's error beyond noise, event by event."""
    with sessions() as session:
        compared = queries.latest_comparisons(session, [queries.version(session, model).id])[model]
    identity = [(one.id, one.created_at) for one, _ in compared]
    return picture(wanted, lambda: error_over_events(answers.rated(compared)), "model-trend", model, identity)


@router.get("/model-diagnosis.svg")
def of_diagnosis(sessions: Reading, number: Annotated[int, Query(ge=1, le=LARGEST)]) -> Tagged:
    """A stored picture of a diagnosis."""
    with sessions() as session:
        svg = queries.picture(session, number)
    return Tagged(svg.encode, SVG, "model-diagnosis", number)


def loops(*, displacement: Vector, measured: Vector, modelled: Vector, title: str) -> alt.LayerChart:
    """Estimated and modelled force (N) over displacement (m) of the isolation layer."""
    layers = [
        _path(displacement, force, name, width)
        for name, force, width in ((MEASURED, measured, 3.0), (MODELLED, modelled, 1.2))
    ]  # the model is drawn last, above
    return alt.LayerChart(layer=layers, title=title, width=460, height=380, config=CONFIG)


def error_over_events(errors: Sequence[RatedError]) -> alt.LayerChart:
    """A model's error beyond noise, event by event, beside the largest usual error."""
    rows = alt.InlineData(values=[_event(one) for one in errors])
    across = alt.X("time:T", title="event (UTC)").scale(type="utc", padding=16)
    kinds = alt.Scale(domain=["fitted", "as usual", "missed"], range=[GREY, BLUE, ORANGE])
    points = (
        alt.Chart(rows)
        .mark_point(size=70, opacity=0.9, filled=True)
        .encode(
            across,
            alt.Y("excess:Q", title="error beyond noise (% of the force)").scale(zero=True),
            color=alt.Color("kind:N", title=None, scale=kinds),
            tooltip=[
                alt.Tooltip("time:T", title="event (UTC)", format="%Y-%m-%d %H:%M:%S"),
                alt.Tooltip("excess:Q", title="error beyond noise (%)", format=".3~g"),
                alt.Tooltip("direction:N", title="direction"),
            ],
        )
    )
    if len({one.event.direction for one in errors}) > 1:
        points = points.encode(shape=alt.Shape("direction:N"))
    layers = [points]
    if errors and errors[0].allowed is not None:
        limit = alt.Chart(alt.InlineData(values=[{"allowed": 100 * errors[0].allowed}]))
        layers.append(limit.mark_rule(strokeDash=[5, 4], color=FAINT).encode(y="allowed:Q"))
    return alt.LayerChart(layer=layers, title="Error over the events", width=460, height=240, config=CONFIG)


def _path(displacement: Vector, force: Vector, name: str, width: float) -> alt.Chart:
    kept = along_path(displacement, force, STEP)
    values = [
        {"order": order, "displacement": float(f"{u:.6g}"), "force": float(f"{f:.6g}"), "of": name}
        for order, (u, f) in enumerate(
            zip((displacement[kept] * MM).tolist(), (force[kept] * KN).tolist(), strict=True)
        )
    ]
    colours = alt.Scale(domain=[MEASURED, MODELLED], range=[GREY, BLUE])
    chart: alt.Chart = (
        alt.Chart(alt.InlineData(values=values))
        .mark_line(strokeWidth=width, strokeJoin="round")
        .encode(
            x=alt.X("displacement:Q", title="displacement of the isolation layer (mm)"),
            y=alt.Y("force:Q", title="restoring force (kN)"),
            order="order:Q",
            color=alt.Color("of:N", title=None, scale=colours),
            tooltip=[
                alt.Tooltip("of:N", title="force"),
                alt.Tooltip("displacement:Q", title="displacement (mm)", format=".4~g"),
                alt.Tooltip("force:Q", title="restoring force (kN)", format=".4~g"),
            ],
        )
    )
    return chart


def _event(rated: RatedError) -> dict[str, object]:
    kind = "fitted" if rated.event.is_fitted else "missed" if rated.is_missed else "as usual"
    return {
        "time": rated.event.start.timestamp() * 1e3,
        "excess": float(f"{100 * rated.excess:.6g}"),
        "kind": kind,
        "direction": rated.event.direction,
    }
