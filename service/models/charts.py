"""The pictures of a model: its loop beside the measured one, and its error over the events."""

from collections.abc import Sequence

import altair as alt

from core.arrays import Vector
from service.models.trend import Judged
from service.reports.charts import BLUE, CONFIG, GREY, KN, MM, ORANGE, STEP
from service.reports.thinning import along_path

MEASURED, MODELLED = "measured", "model"


def loops(*, displacement: Vector, measured: Vector, modelled: Vector, title: str) -> alt.LayerChart:
    """Estimated and modelled force (N) over displacement (m) of the isolation layer."""
    layers = [
        _path(displacement, force, name, width)
        for name, force, width in ((MEASURED, measured, 3.0), (MODELLED, modelled, 1.2))
    ]  # the model is drawn last, above
    return alt.LayerChart(layer=layers, title=title, width=460, height=380, config=CONFIG)


def trend(judged: Sequence[Judged]) -> alt.LayerChart:
    """A model's error beyond noise, event by event, beside the largest usual error."""
    rows = alt.InlineData(values=[_event(one) for one in judged])
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
                alt.Tooltip("time:T", format="%Y-%m-%d %H:%M:%S"),
                alt.Tooltip("excess:Q", format=".3~g"),
                alt.Tooltip("direction:N"),
            ],
        )
    )
    if len({one.held.direction for one in judged}) > 1:
        points = points.encode(shape=alt.Shape("direction:N"))
    layers = [points]
    if judged and judged[0].allowed is not None:
        limit = alt.Chart(alt.InlineData(values=[{"allowed": 100 * judged[0].allowed}]))
        layers.append(limit.mark_rule(strokeDash=[5, 4], color="#5b6675").encode(y="allowed:Q"))
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
        )
    )
    return chart


def _event(judged: Judged) -> dict[str, object]:
    kind = "fitted" if judged.held.is_fitted else "missed" if judged.is_missed else "as usual"
    return {
        "time": judged.held.start.timestamp() * 1e3,
        "excess": float(f"{100 * judged.excess:.6g}"),
        "kind": kind,
        "direction": judged.held.direction,
    }
