"""Figures of a sketch: the missing force over the variable that it depends on, and beside the law for it."""

from collections.abc import Iterator, Mapping
from typing import cast

import altair as alt

from service.documents.charts import BLUE, FAINT, GREY, KN, MM, ORANGE, WIDTH, brief, curves, shown_on_hover, values
from service.documents.document import Figure, Rows, numbers
from service.models import texts
from service.models.sketch_results import BinOut, CourseOut

HEIGHT = 300
"""Pixels."""
LABELS: Mapping[str, tuple[str, float]] = {
    "displacement": ("displacement (mm)", MM),
    "velocity": ("velocity (mm/s)", MM),
    "largest past displacement": ("largest past displacement (mm)", MM),
    "travel": ("travel (m)", 1.0),
    "axial load": ("vertical load / weight", 1.0),
    "temperature": ("temperature (°C)", 1.0),
    "other direction": ("other direction (mm)", MM),
}
"""Label of an axis, and its unit per SI unit."""
MEAN, TO_PLUS, TO_MINUS = "mean", "in the positive direction", "in the negative direction"
BRANCHES = {0: (MEAN, BLUE), 1: (TO_PLUS, BLUE), -1: (TO_MINUS, ORANGE)}
"""Name and colour of each branch."""
FITTED, HELD_OUT = "fitted", "held out"
MISSING, LAW = "missing force (kN)", "force of the law (kN)"


def sketch_figures(one: CourseOut) -> list[Figure]:
    """The figures of a sketch."""
    return [figure for figure in (force(one), beside_law(one)) if figure is not None]


def layered(figure: Figure) -> alt.LayerChart:
    """The one picture of a figure of a sketch."""
    return cast(alt.LayerChart, figure.pictures[0])


def force(one: CourseOut, width: int = WIDTH) -> Figure:
    """Missing force over its variable: samples, and the means of both directions of motion with their deviations.

    Args:
        one: the missing force over one variable.
        width: pixels of the picture.
    """
    label, unit = LABELS[one.variable]
    lines: Rows = [_bin(part, unit) for part in one.bins]
    points: Rows = [
        {"x": brief(at * unit), "y": brief(of * KN)}
        for trace in one.traces
        for at, of in zip(trace.variable, trace.force, strict=True)
        if at is not None and of is not None
    ]
    across, up = alt.X("x:Q", title=label).scale(nice=False, zero=False), alt.Y("y:Q", title=MISSING)
    shown = {name: colour for key, (name, colour) in BRANCHES.items() if any(part.branch == key for part in one.bins)}
    colour = curves(shown)
    hover = [
        alt.Tooltip("curve:N", title="curve"),
        *shown_on_hover(x=label, y=MISSING, low="low (kN)", high="high (kN)", law=LAW),
    ]
    base = alt.Chart(values(lines))
    layers = [
        alt.Chart(values(points)).mark_point(filled=True, size=7, color=GREY, opacity=0.6).encode(across, up),
        base.mark_area(opacity=0.25).encode(across, alt.Y("low:Q", title=MISSING), alt.Y2("high:Q"), color=colour),
        base.mark_line(strokeWidth=1.8).encode(across, up, color=colour, tooltip=hover),
    ]
    if any(part.law is not None for part in one.bins):
        dashed = base.mark_line(strokeWidth=1.6, strokeDash=[5, 3])
        layers.append(dashed.encode(across, alt.Y("law:Q", title=MISSING), color=colour, tooltip=hover))
    title, caption = texts.FIGURES["sketch_force"]
    picture = alt.LayerChart(layer=layers, width=width, height=HEIGHT)
    return Figure("force", title, caption, (picture,), numbers(lines))


def beside_law(one: CourseOut, width: int = WIDTH // 2) -> Figure | None:
    """Missing force over the force of the proposed law; None without one. Arguments as above."""
    rows: Rows = list(_pairs(one))
    if not rows:
        return None
    ends = [bound(row[key] for row in rows for key in ("law", "force")) for bound in (min, max)]
    groups = {FITTED: GREY, HELD_OUT: ORANGE}
    shown = {group: colour for group, colour in groups.items() if any(row["curve"] == group for row in rows)}
    across, up = alt.X("law:Q", title=LAW).scale(nice=False), alt.Y("force:Q", title=MISSING).scale(nice=False)
    equal = alt.Chart(values([{"law": end, "force": end} for end in ends])).mark_line(color=FAINT, strokeDash=[5, 4])
    hover = [alt.Tooltip("curve:N", title="earthquakes"), *shown_on_hover(law=LAW, force=MISSING)]
    points = (
        alt.Chart(values(rows))
        .mark_point(filled=True, size=10, opacity=0.7)
        .encode(across, up, color=dots(shown), tooltip=hover)
    )
    title, caption = texts.FIGURES["sketch_law"]
    picture = alt.LayerChart(layer=[points, equal.encode(across, up)], width=width, height=HEIGHT)
    return Figure("law", title, caption, (picture,), numbers(rows))


def dots(colours: Mapping[str, str]) -> alt.Color:
    """A colour for each group of points, named above the picture."""
    legend = alt.Legend(title=None, orient="top", symbolType="circle", symbolSize=60, symbolOpacity=1.0)
    return alt.Color("curve:N", scale=alt.Scale(domain=list(colours), range=list(colours.values())), legend=legend)


def _bin(part: BinOut, unit: float) -> dict[str, object]:
    mean, deviation = (part.mean or 0.0) * KN, 2 * (part.std or 0.0) * KN
    return {
        "curve": BRANCHES[part.branch][0],
        "x": brief(((part.low or 0.0) + (part.high or 0.0)) / 2 * unit),
        "y": brief(mean),
        "low": brief(mean - deviation),
        "high": brief(mean + deviation),
        "law": None if part.law is None else brief(part.law * KN),
    }


def _pairs(one: CourseOut) -> Iterator[dict[str, object]]:
    for trace in one.traces:
        for force_of, law in zip(trace.force, trace.law or (), strict=trace.law is not None):
            if force_of is not None and law is not None:
                group = HELD_OUT if trace.held_out else FITTED
                yield {"curve": group, "law": brief(law * KN), "force": brief(force_of * KN)}
