"""Pictures of the models' pages, drawn on the server: the loop, the error over the events, and those of diagnoses."""

from collections.abc import Mapping, Sequence
from typing import Annotated

import altair as alt
import numpy as np
from fastapi import APIRouter, Depends, Query, Response

from core.arrays import Vector
from core.effects import EFFECTS
from core.errors import ModelError
from service.access.auth import viewer
from service.db.blobs import decode_history
from service.documents.charts import (
    BLUE,
    CONFIG,
    FAINT,
    GREY,
    KN,
    MM,
    ORANGE,
    STEP,
    Picture,
    brief,
    curves,
    shown_on_hover,
    values,
    wider,
)
from service.documents.thinning import along_path
from service.errors import ConflictError, NotFoundError
from service.http.parameters import LARGEST, Reading
from service.http.rendering import SVG, As, picture, specified
from service.http.responses import Tagged, TaggedRoute
from service.jobs import requests as job_requests
from service.models import answers, queries
from service.models.api.kept_effects import known
from service.models.effect_loops import ALONE, WITH, WITHOUT, loops as loops_of_effect, read_values
from service.models.effects import law
from service.models.figures.forecasts import accelerations, displacement, drawn
from service.models.figures.improvements import left_out_figure
from service.models.figures.sketches import beside_law, force as missing_force, layered
from service.models.forecast_results import ForecastDocument, ForecastOut
from service.models.results import MisfitOut
from service.models.schema import ErrorOut, Errors
from service.models.sketch_results import SketchDocument
from service.models.trend import RatedError
from service.models.windows import BLOCK

MEASURED, MODELLED = "measured", "model"
COLOURS = alt.Scale(domain=[MEASURED, MODELLED], range=[GREY, BLUE])
WAYS = {WITHOUT: GREY, WITH: BLUE, ALONE: ORANGE}
"""Colours of the loops of an effect."""
FITTED, HELD_OUT, LATER, USUAL, MISSED = "fitted", "held out", "later", "as usual", "missed"
NARROW, BROAD = 400, 560
"""Pixels, width of a chart of a forecast or a sketch."""
GROUPS = {FITTED: BLUE, HELD_OUT: ORANGE, LATER: GREY}
"""Colours of the groups of earthquakes that errors are given for."""

EffectName = Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,64}$")]

router = APIRouter(
    prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer), Depends(known)], route_class=TaggedRoute
)


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


@router.get("/model-window.{form}")
def window(
    wanted: As,
    sessions: Reading,
    comparison: Annotated[int, Query(ge=1, le=LARGEST)],
    start: Annotated[float, Query(ge=0, le=1e6, allow_inf_nan=False)],
) -> Response:
    """Estimated and modelled force in a few seconds of a record: over displacement, and over time."""
    with sessions() as session:
        stored = queries.comparison(session, comparison)
        measured = queries.measured(session, stored.analysis_id, stored.direction)

    def draw() -> Picture:
        first = round(start * measured.rate)
        within = slice(first, first + round(BLOCK * measured.rate) + 1)
        displacement, force, modelled = (
            decode_history(blob)[within] for blob in (measured.displacement, measured.force, stored.force)
        )
        if displacement.size < 2:
            raise NotFoundError("window at second", start)
        time = start + np.arange(displacement.size) / measured.rate
        return beside(time, displacement, force, modelled)

    return picture(wanted, draw, "model-window", stored.id, stored.created_at, start)


@router.get("/model-lineage.{form}")
def lineage(wanted: As, sessions: Reading, model: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Error of each version that led to a model, all in the events that the model was compared with."""
    with sessions() as session:
        queries.version(session, model)
        line = queries.lineage(session, model)
        compared = queries.latest_comparisons(session, [one.id for one in line])
        found = answers.errors_in_the_same_events([compared[one.id] for one in line])
        names = [f"{one.direction} {one.number}" for one in line]
    errors = [(name, dict(zip(GROUPS, _by_role(one), strict=True))) for name, one in zip(names, found, strict=True)]
    return picture(wanted, lambda: falls(errors), "model-lineage", model, errors)


@router.get("/diagnosis-versions.{form}")
def versions(wanted: As, sessions: Reading, diagnosis: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Error of the model as given, refitted, and with each effect that a diagnosis proposes."""
    with sessions() as session:
        found = answers.diagnosis(queries.diagnosis(session, diagnosis)).versions
    errors = [(one.name, {FITTED: one.error.nrmse, HELD_OUT: _error(one.error_held_out)}) for one in found]
    return picture(wanted, lambda: falls(errors), "diagnosis-versions", diagnosis)


@router.get("/forecast-displacement.{form}")
def forecast_displacement(wanted: As, sessions: Reading, job: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Displacement of the isolators in a forecast."""
    found = _forecast(sessions, job)
    return picture(wanted, lambda: drawn(displacement(found, NARROW)), "forecast-displacement", job)


@router.get("/forecast-accelerations.{form}")
def forecast_accelerations(wanted: As, sessions: Reading, job: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Largest accelerations of the levels in a forecast."""
    found = _forecast(sessions, job)
    return picture(wanted, lambda: drawn(accelerations(found, NARROW)), "forecast-accelerations", job)


def _forecast(sessions: Reading, number: int) -> ForecastOut:
    with sessions() as session:
        result = job_requests.job(session, number).result or {}
    if "forecast" not in result:
        raise NotFoundError("forecast", number)
    return ForecastDocument.model_validate(result["forecast"]).forecasts[0]


@router.get("/sketch-force.{form}")
def sketch_force(wanted: As, sessions: Reading, job: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """The missing force of a sketch over the variable that it depends on."""
    found = _sketch(sessions, job)
    return picture(wanted, lambda: layered(missing_force(found.course, BROAD)), "sketch-force", job)


@router.get("/sketch-law.{form}")
def sketch_law(wanted: As, sessions: Reading, job: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """The missing force of a sketch over the force of the proposed law."""
    found = beside_law(_sketch(sessions, job).course, NARROW)
    if found is None:
        raise NotFoundError("law of sketch", job)
    return picture(wanted, lambda: layered(found), "sketch-law", job)


@router.get("/sketch-versions.{form}")
def sketch_versions(wanted: As, sessions: Reading, job: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Error of the model as given, refitted, and with the law of a sketch."""
    found = _sketch(sessions, job).versions
    errors = [(one.name, {FITTED: one.error.nrmse, HELD_OUT: _error(one.error_held_out)}) for one in found]
    return picture(wanted, lambda: falls(errors), "sketch-versions", job)


@router.get("/improvement.{form}")
def improvement(wanted: As, sessions: Reading, job: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Error in earthquakes left out, after each change of an improvement."""
    with sessions() as session:
        steps = answers.improvement_steps(job_requests.job(session, job))
    if not steps:
        raise NotFoundError("changes of improvement", job)
    return picture(wanted, lambda: drawn(left_out_figure(steps, BROAD)), "improvement", job)


def _sketch(sessions: Reading, number: int) -> SketchDocument:
    with sessions() as session:
        result = job_requests.job(session, number).result or {}
    if "sketch" not in result:
        raise NotFoundError("sketch", number)
    return SketchDocument.model_validate(result["sketch"])


@router.get("/effect.{form}")
def of_effect(wanted: As, name: EffectName) -> Response:
    """Loops of an effect at the values of the query, in the units that engineers read."""
    if name not in EFFECTS:
        raise NotFoundError("effect", name)
    values, amplitude = read_values(name, wanted.request.query_params)

    def draw() -> Picture:
        try:
            return effect_chart(name, loops_of_effect(name, values, amplitude))
        except ModelError as error:
            raise ConflictError(f"{str(error).capitalize()}; choose others.") from None

    return picture(wanted, draw, "effect", name, law(EFFECTS[name]), values, amplitude)


def _by_role(errors: Errors) -> tuple[float | None, ...]:
    return _error(errors.fitted), _error(errors.held_out), _error(errors.later)


def _error(of: ErrorOut | MisfitOut | None) -> float | None:
    return None if of is None else of.nrmse


@router.get("/model-diagnosis.{form}")
def of_diagnosis(wanted: As, sessions: Reading, number: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """A stored chart of a diagnosis; of one that was stored as a picture, that picture alone."""
    with sessions() as session:
        stored = queries.picture(session, number)
        svg, spec = stored.svg, stored.spec
    if spec is not None:
        whole = {**spec, "config": CONFIG}
        return specified(wanted, lambda: whole, "model-diagnosis", number)
    if svg is None or wanted.form != "svg":
        raise NotFoundError("numbers of a picture that an earlier version drew: diagnosis picture", number)
    return Tagged(svg.encode, SVG, "stored-picture", number)


def loops(*, displacement: Vector, measured: Vector, modelled: Vector, title: str) -> alt.LayerChart:
    """Estimated and modelled force (N) over displacement (m) of the isolation layer."""
    layers = [
        _path(displacement, force, name, width)
        for name, force, width in ((MEASURED, measured, 3.0), (MODELLED, modelled, 1.2))
    ]  # the model is drawn last, above
    return alt.LayerChart(layer=layers, title=title, width=460, height=380, config=CONFIG)


def beside(time: Vector, displacement: Vector, measured: Vector, modelled: Vector) -> alt.HConcatChart:
    """A part of a record: estimated and modelled force (N) over displacement (m), and over time (s)."""
    loop = loops(displacement=displacement, measured=measured, modelled=modelled, title="").properties(
        width=330, height=250
    )
    rows = [
        {"of": name, "time": brief(at), "force": brief(force * KN)}
        for name, series in ((MEASURED, measured), (MODELLED, modelled))
        for at, force in zip(time, series, strict=True)
    ]
    lines = (
        alt.Chart(values(rows), width=420, height=250)
        .mark_line()
        .encode(
            x=alt.X("time:Q", title="time after the start of the record (s)").scale(nice=False, zero=False),
            y=alt.Y("force:Q", title="restoring force (kN)"),
            color=alt.Color("of:N", title=None, scale=COLOURS),
            strokeWidth=wider(MEASURED, 3.0, 1.2, "of"),
            tooltip=[
                alt.Tooltip("of:N", title="force"),
                *shown_on_hover(time="time (s)", force="restoring force (kN)"),
            ],
        )
    )
    loop = loop.properties(width=330, height=250)
    loop.title = loop.config = alt.Undefined
    shown: alt.HConcatChart = alt.hconcat(loop, alt.LayerChart(layer=[lines]), spacing=30, config=CONFIG)
    return shown


def falls(versions: Sequence[tuple[str, Mapping[str, float | None]]]) -> alt.LayerChart:
    """Error of the force (share of it) of successive versions, by group of earthquakes: what each change removed."""
    rows: list[dict[str, object]] = []
    before: dict[str, float] = {}
    for name, errors in versions:
        for group, error in errors.items():
            if error is not None:
                was = before.get(group, error)
                row = {"error": 100 * error, "before": 100 * max(was, error), "change": 100 * (error - was)}
                rows.append({"version": name, "group": group} | {key: brief(value) for key, value in row.items()})
                before[group] = error
    groups = [group for group in GROUPS if group in before]
    legend = alt.Legend(symbolOpacity=1.0)
    colour = alt.Color("group:N", title="earthquakes", sort=groups, legend=legend).scale(
        domain=groups, range=[GROUPS[group] for group in groups]
    )
    across = alt.X("version:N", title=None, sort=None).axis(labelAngle=0, labelLimit=220)
    base = alt.Chart(values(rows)).encode(across, xOffset=alt.XOffset("group:N", sort=groups), color=colour)
    up = alt.Y("error:Q", title="error of the force (% of it)")
    hover = [
        alt.Tooltip("version:N", title="version"),
        alt.Tooltip("group:N", title="earthquakes"),
        *shown_on_hover(error="error (%)", change="change (%)"),
    ]
    removed = base.mark_bar(opacity=0.3).encode(up, alt.Y2("before:Q"), tooltip=hover)
    left = base.mark_bar().encode(up, tooltip=hover)
    return alt.LayerChart(layer=[removed, left], title="Error of each version", width=620, height=240, config=CONFIG)


def effect_chart(name: str, found: Mapping[str, tuple[Vector, Vector]]) -> alt.HConcatChart:
    """Loops of a layer without and with an effect, and of the effect alone if it adds a force."""
    panels = [_effect_panel(found, (WITHOUT, WITH), "force of the layer (kN)")]
    if ALONE in found:
        panels.append(_effect_panel(found, (ALONE,), "force of the effect (kN)"))
    shown: alt.HConcatChart = alt.hconcat(*panels, spacing=30, title=EFFECTS[name].title, config=CONFIG)
    return shown


def _effect_panel(found: Mapping[str, tuple[Vector, Vector]], ways: Sequence[str], up: str) -> alt.LayerChart:
    rows = [
        {"curve": way, "order": order, "displacement": brief(u[at] * MM), "force": brief(force[at] * KN)}
        for way in ways
        for u, force in (found[way],)
        for order, at in enumerate(along_path(u, force, STEP))
    ]
    colours = {way: WAYS[way] for way in WAYS if way in found}
    lines = (
        alt.Chart(values(rows), width=380, height=300)
        .mark_line(strokeJoin="round")
        .encode(
            x=alt.X("displacement:Q", title="displacement (mm)"),
            y=alt.Y("force:Q", title=up),
            order="order:Q",
            color=curves(colours),
            strokeWidth=wider(WITHOUT, 2.6, 1.3),
            tooltip=[
                alt.Tooltip("curve:N", title="curve"),
                *shown_on_hover(displacement="displacement (mm)", force="force (kN)"),
            ],
        )
    )
    return alt.LayerChart(layer=[lines])


def error_over_events(errors: Sequence[RatedError]) -> alt.LayerChart:
    """A model's error beyond noise, event by event, beside the largest usual error."""
    rows = values([_event(one) for one in errors])
    across = alt.X("time:T", title="event (UTC)").scale(type="utc", padding=16)
    kinds = alt.Scale(domain=[FITTED, USUAL, MISSED], range=[GREY, BLUE, ORANGE])
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
        points = points.encode(shape=alt.Shape("direction:N", title="direction"))
    layers = [points]
    if errors and errors[0].allowed is not None:
        limit = alt.Chart(values([{"allowed": 100 * errors[0].allowed}]))
        layers.append(limit.mark_rule(strokeDash=[5, 4], color=FAINT).encode(y="allowed:Q"))
    return alt.LayerChart(layer=layers, title="Error over the events", width=460, height=240, config=CONFIG)


def _path(displacement: Vector, force: Vector, name: str, width: float) -> alt.Chart:
    kept = along_path(displacement, force, STEP)
    rows = [
        {"order": order, "displacement": float(f"{u:.6g}"), "force": float(f"{f:.6g}"), "of": name}
        for order, (u, f) in enumerate(
            zip((displacement[kept] * MM).tolist(), (force[kept] * KN).tolist(), strict=True)
        )
    ]
    chart: alt.Chart = (
        alt.Chart(values(rows))
        .mark_line(strokeWidth=width, strokeJoin="round")
        .encode(
            x=alt.X("displacement:Q", title="displacement of the isolation layer (mm)"),
            y=alt.Y("force:Q", title="restoring force (kN)"),
            order="order:Q",
            color=alt.Color("of:N", title=None, scale=COLOURS),
            tooltip=[
                alt.Tooltip("of:N", title="force"),
                alt.Tooltip("displacement:Q", title="displacement (mm)", format=".4~g"),
                alt.Tooltip("force:Q", title="restoring force (kN)", format=".4~g"),
            ],
        )
    )
    return chart


def _event(rated: RatedError) -> dict[str, object]:
    kind = FITTED if rated.event.is_fitted else MISSED if rated.is_missed else USUAL
    return {
        "time": rated.event.start.timestamp() * 1e3,
        "excess": float(f"{100 * rated.excess:.6g}"),
        "kind": kind,
        "direction": rated.event.direction,
    }
