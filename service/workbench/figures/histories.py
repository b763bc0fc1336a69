"""How do measured and modelled histories of one earthquake lie beside each other? As a loop, and over time."""

from collections.abc import Sequence

import altair as alt
import numpy as np

from core.arrays import Vector
from core.comparison import ForceComparison
from core.prediction import Prediction
from service.charts import BLUE, GREY, KN, MM, ORANGE, STEP
from service.thinning import along_path, extremes
from service.workbench.figure import MEASURED, MODEL, WIDTH, Figure, Rows, curves, table, values

LOOP, HEIGHT = (600, 420), 150
"""Pixels."""
POINTS = 1700
"""Of a history: two for each pixel."""
ENLARGED = 3
"""Times the residual in the loop."""
RESIDUAL = f"residual × {ENLARGED}"


def strongest_of(forces: Sequence[ForceComparison]) -> ForceComparison:
    """The earthquake of the largest motion."""
    return max(forces, key=lambda one: float(np.abs(one.observation.layer.displacement).max()))


def loop(one: ForceComparison) -> Figure:
    """The loop of one earthquake, and three times what the model leaves."""
    x = one.observation.layer.displacement * MM
    forces = {MEASURED: one.observation.layer.force, MODEL: one.model, RESIDUAL: ENLARGED * one.residual}
    rows: Rows = [
        {"curve": name, "order": int(at), "displacement (mm)": float(x[at]), "force (kN)": float(force[at] * KN)}
        for name, force in forces.items()
        for at in along_path(x, force, STEP)
    ]
    layers = [
        alt.Chart(values([row for row in rows if row["curve"] == name]), width=LOOP[0], height=LOOP[1])
        .mark_line(strokeWidth=width, strokeJoin="round")
        .encode(
            x=alt.X("displacement (mm):Q").scale(nice=False, padding=10),
            y=alt.Y("force (kN):Q"),
            order="order:Q",
            color=curves({MEASURED: GREY, MODEL: BLUE, RESIDUAL: ORANGE}),
        )
        for name, width in ((MEASURED, 3.2), (MODEL, 1.1), (RESIDUAL, 1.1))
    ]
    caption = (
        f"The earthquake of {one.observation.name}, the one of the largest displacement. Residual: measured − model. "
        "Where its ends turn up: hardening or a moat wall; ends unlike each other: an asymmetry; steps at the "
        "reversals: friction, or another yield; a loop of its own: damping that is missing."
    )
    picture = alt.LayerChart(layer=layers)
    return Figure("loop", "Loop of the strongest earthquake", caption, picture, table(rows))


def histories(force: ForceComparison, prediction: Prediction | None) -> Figure:
    """Force, and the displacement that is predicted from the ground alone, of one earthquake."""
    rate = force.observation.rate
    panels = [_history(force.observation.layer.force * KN, force.model * KN, rate, "restoring force (kN)")]
    said = "driven by the measured motion"
    if prediction is not None:
        moved = prediction.displacement
        panels.append(_history(moved.measured * MM, moved.model * MM, rate, "displacement (mm)"))
        said += "; below, the displacement that model and superstructure predict from the ground motion alone"
    caption = f"The earthquake of {force.observation.name}, the one of the largest displacement: the force, {said}."
    rows: Rows = [
        {"time (s)": float(at / rate), "force (kN)": float(force.observation.layer.force[at] * KN)}
        | {"model (kN)": float(force.model[at] * KN)}
        for at in extremes(force.model, POINTS // 4)
    ]
    return Figure("histories", "Measured and modelled", caption, alt.vconcat(*panels, spacing=10), table(rows))


def _history(measured: Vector, model: Vector, rate: float, label: str) -> alt.LayerChart:
    layers = [
        alt.Chart(values(_rows(name, series, rate)), width=WIDTH, height=HEIGHT)
        .mark_line(strokeWidth=width)
        .encode(
            x=alt.X("x:Q", title="time after the start of the record (s)").scale(nice=False),
            y=alt.Y("y:Q", title=label).axis(minExtent=55),
            color=curves({MEASURED: GREY, MODEL: BLUE}),
        )
        for name, series, width in ((MEASURED, measured, 2.2), (MODEL, model, 1.0))
    ]
    return alt.LayerChart(layer=layers)


def _rows(name: str, series: Vector, rate: float) -> Rows:
    return [{"curve": name, "x": float(at / rate), "y": float(f"{series[at]:.5g}")} for at in extremes(series, POINTS)]
