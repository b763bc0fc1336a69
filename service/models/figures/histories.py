"""Measured and modelled histories of one earthquake, as a loop and over time."""

from collections.abc import Sequence, Sized

import altair as alt
import numpy as np

from core.arrays import Vector
from core.comparison.compared import ForceComparison
from core.comparison.prediction import Prediction
from service.documents.charts import (
    BLUE,
    GREY,
    KN,
    MM,
    ORANGE,
    STEP,
    WIDTH,
    brief,
    curves,
    shown_on_hover,
    values,
    wider,
)
from service.documents.document import Figure, Rows, numbers
from service.documents.thinning import along_path, extremes
from service.models import texts

MEASURED, MODEL = "measured", "model"
LOOP, HEIGHT = (600, 420), 150
"""Pixels."""
SPARE = 45
"""Pixels, for the axis of a loop beside another."""
POINTS = 1700
"""Points of a history: two for each pixel."""
ENLARGED = 3
"""Times the residual in the loop."""
RESIDUAL = f"residual × {ENLARGED}"


def strongest_of(forces: Sequence[ForceComparison]) -> tuple[ForceComparison, ...]:
    """The earthquake of the largest motion, in every direction."""
    largest = max(forces, key=lambda one: float(np.abs(one.observation.layer.displacement).max()))
    return tuple(one for one in forces if one.observation.start == largest.observation.start)


def loop(directions: Sequence[ForceComparison]) -> Figure:
    """The loop of one earthquake in every direction, and three times what the model leaves."""
    parts = {one.observation.direction: _loop_rows(one) for one in directions}
    title, caption = texts.FIGURES["loop"]
    width = LOOP[0] if len(parts) == 1 else WIDTH // 2 - SPARE
    panels = [_titled(_loop(rows, width), name, parts) for name, rows in parts.items()]
    rows = [{"direction": name, **row} for name, rows in parts.items() for row in rows]
    name = directions[0].observation.name
    return Figure("loop", title, caption.format(name=name), (alt.hconcat(*panels),), numbers(rows))


def _loop_rows(one: ForceComparison) -> Rows:
    x = one.observation.layer.displacement * MM
    forces = {MEASURED: one.observation.layer.force, MODEL: one.model, RESIDUAL: ENLARGED * one.residual}
    return [
        {"curve": name, "order": int(at), "displacement (mm)": brief(x[at]), "force (kN)": brief(force[at] * KN)}
        for name, force in forces.items()
        for at in along_path(x, force, STEP)
    ]


def _loop(rows: Rows, width: int) -> alt.LayerChart:
    lines = (
        alt.Chart(values(rows), width=width, height=LOOP[1])
        .mark_line(strokeJoin="round")
        .encode(
            x=alt.X("displacement (mm):Q", title="displacement (mm)").scale(nice=False, padding=10),
            y=alt.Y("force (kN):Q", title="force (kN)"),
            order="order:Q",
            color=curves({MEASURED: GREY, MODEL: BLUE, RESIDUAL: ORANGE}),
            strokeWidth=wider(MEASURED, 3.2, 1.1),
            tooltip=[alt.Tooltip("curve:N", title="curve"), *shown_on_hover("displacement (mm)", "force (kN)")],
        )
    )
    return alt.LayerChart(layer=[lines])


def histories(forces: Sequence[ForceComparison], predictions: Sequence[Prediction]) -> Figure:
    """Force, and the displacement that is predicted from the ground alone, of one earthquake in every direction."""
    moved = {one.observation.direction: one for one in predictions}
    panels: list[alt.LayerChart] = []
    for one in forces:
        own = _panels(one, moved.get(one.observation.direction))
        panels += [_titled(own[0], one.observation.direction, forces), *own[1:]]
    title, caption = texts.FIGURES["histories"]
    predicted = texts.PREDICTED if predictions else ""
    caption = caption.format(name=forces[0].observation.name, predicted=predicted)
    rows: Rows = [
        {"direction": one.observation.direction, "time (s)": float(at / one.observation.rate)}
        | {"force (kN)": float(one.observation.layer.force[at] * KN), "model (kN)": float(one.model[at] * KN)}
        for one in forces
        for at in extremes(one.model, POINTS // 4)
    ]
    return Figure("histories", title, caption, (alt.vconcat(*panels, spacing=10),), numbers(rows))


def _panels(force: ForceComparison, prediction: Prediction | None) -> list[alt.LayerChart]:
    rate, layer = force.observation.rate, force.observation.layer
    panels = [_history(layer.force * KN, force.model * KN, rate, "restoring force (kN)")]
    if prediction is not None:
        moved = prediction.displacement
        panels.append(_history(moved.measured * MM, moved.model * MM, rate, "displacement (mm)"))
    return panels


def _titled(panel: alt.LayerChart, direction: str, directions: Sized) -> alt.LayerChart:
    """With its direction where there are several."""
    return panel.properties(title=f"direction {direction}") if len(directions) > 1 else panel


def _history(measured: Vector, model: Vector, rate: float, label: str) -> alt.LayerChart:
    rows = [*_rows(MEASURED, measured, rate), *_rows(MODEL, model, rate)]
    lines = (
        alt.Chart(values(rows), width=WIDTH, height=HEIGHT)
        .mark_line()
        .encode(
            x=alt.X("x:Q", title="time after the start of the record (s)").scale(nice=False),
            y=alt.Y("y:Q", title=label).axis(minExtent=55),
            color=curves({MEASURED: GREY, MODEL: BLUE}),
            strokeWidth=wider(MEASURED, 2.2, 1.0),
            tooltip=[alt.Tooltip("curve:N", title="curve"), *shown_on_hover(x="time (s)", y=label)],
        )
    )
    return alt.LayerChart(layer=[lines])


def _rows(name: str, series: Vector, rate: float) -> Rows:
    return [{"curve": name, "x": brief(at / rate), "y": brief(series[at])} for at in extremes(series, POINTS)]
