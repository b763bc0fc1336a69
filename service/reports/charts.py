"""Pictures of the reports: small, and readable in grey, because curves differ by shade, width and dashes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

import altair as alt
import numpy as np

from core.arrays import Vector
from service.documents.charts import KN, MM, STEP
from service.documents.thinning import along_path, extremes

GAL = 1e2
POINTS = 700
"""Samples of a history: two for each point of a printed page's width."""
SIDE = 118
"""Points of 1/72 inch, height of a square picture."""
WIDE = 620
INK, GREY, LIGHT = "#111111", "#5b6675", "#b9bfc7"
WEIGHT: Literal[500] = 500
"""Weight of letters: the compiler of the page draws weight 400 of a variable font too thin inside pictures."""
CONFIG: Mapping[str, Any] = {
    "font": "Source Sans 3, IPAexGothic, Arial, sans-serif",
    "padding": 2,
    "axis": {"labelFontSize": 7, "titleFontSize": 7.5, "titlePadding": 3, "tickSize": 3, "labelPadding": 2}
    | {"labelFontWeight": WEIGHT, "titleFontWeight": WEIGHT}
    | {"gridColor": "#e4e6e9", "gridWidth": 0.5, "domainColor": GREY, "tickColor": GREY},
    "legend": {"labelFontSize": 7, "labelFontWeight": WEIGHT, "symbolSize": 60, "rowPadding": 1, "padding": 0},
    "text": {"fontSize": 7, "fontWeight": WEIGHT},
    "view": {"stroke": "#c5cad1", "strokeWidth": 0.5},
}


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """A series over the time since the event's start."""

    title: str
    """Title of its axis, with the unit."""
    time: Vector
    """(n,) s."""
    values: Vector
    """(n,) in the unit of the title."""


def orbit(x: Vector, y: Vector, circles: Sequence[tuple[str, float]]) -> alt.LayerChart:
    """Path of the isolation layer in plan.

    Args:
        x: (n,) m.
        y: (n,) m.
        circles: names and radii (m) to draw around the position at rest, such as that of the moat.
    """
    kept = along_path(x, y, STEP)
    rows = [{"x": a, "y": b, "n": n} for n, (a, b) in enumerate(zip(_mm(x[kept]), _mm(y[kept]), strict=True))]
    largest = 1.08 * MM * max([*(radius for _, radius in circles), float(abs(x).max()), float(abs(y).max())]) or 1.0
    scale = alt.Scale(domain=[-largest, largest], nice=False)
    axes = {"x": alt.X("x:Q", title="x (mm)", scale=scale), "y": alt.Y("y:Q", title="y (mm)", scale=scale)}
    layers = [_circle(radius * MM, number, axes) for number, (_, radius) in enumerate(circles)]
    path = alt.Chart(_values(rows)).mark_line(color=INK, strokeWidth=0.8, strokeJoin="round")
    layers.append(path.encode(**axes, order="n:Q"))
    return _chart([*layers, *_labels(circles, axes)], SIDE, SIDE)


def loops(loop: tuple[Vector, Vector], earlier: Sequence[tuple[Vector, Vector]]) -> alt.LayerChart:
    """Restoring force (N) over displacement (m): this earthquake in black, over the earlier ones in grey."""
    axes = {
        "x": alt.X("displacement:Q", title="displacement of the isolators (mm)").axis(tickCount=6),
        "y": alt.Y("force:Q", title="restoring force (kN)").axis(tickCount=5),
        "order": "n:Q",
    }
    layers = [_loop(one, LIGHT, 0.6, axes) for one in earlier]
    return _chart([*layers, _loop(loop, INK, 0.8, axes)], SIDE + 12, SIDE)


def spectra(
    periods: Vector, measured: Mapping[str, Vector], design: tuple[Sequence[float], Sequence[float]] | None
) -> alt.LayerChart:
    """Response spectra (m/s²) over the period (s), 5 % damping: x solid, y dashed, the design's thick and grey."""
    x = alt.X("period:Q", title="period (s)").scale(type="log", nice=False).axis(values=[0.05, 0.1, 0.5, 1, 5, 10])
    y = alt.Y("gal:Q", title="response acceleration (gal)").axis(tickCount=5)
    dashes = {"x": [1, 0], "y": [4, 2]}
    layers = [
        alt.Chart(_rows(period=periods, gal=values * GAL))
        .mark_line(color=INK, strokeWidth=1, strokeDash=dashes.get(direction, [1, 0]))
        .encode(x, y)
        for direction, values in measured.items()
    ]
    if design is not None:
        rows = _rows(period=np.array(design[0]), gal=np.array(design[1]) * GAL)
        layers.insert(0, alt.Chart(rows).mark_line(color=LIGHT, strokeWidth=2.5).encode(x, y))
    return _chart(layers, SIDE + 12, SIDE)


def histories(shown: Sequence[History]) -> alt.VConcatChart:
    """Series over time, one below the other, along one axis."""
    start = min(float(one.time[0]) for one in shown)
    end = max(float(one.time[-1]) for one in shown)
    panels = [_panel(one, (start, end), is_last=one is shown[-1]) for one in shown]
    return alt.vconcat(*panels, spacing=20, bounds="flush", config=dict(CONFIG))


def trend(values: Mapping[str, Sequence[tuple[datetime, float, float, bool]]], title: str) -> alt.LayerChart:
    """Changes (relative) over the years, with bars of ± 2 standard deviations.

    Args:
        values: by direction: (start of the earthquake, change, standard deviation, whether it is of the reference).
        title: of the axis.
    """
    rows: list[dict[str, Any]] = [
        {"start": start.timestamp() * 1e3, "value": 100 * value, "low": 100 * (value - 2 * std)}
        | {"high": 100 * (value + 2 * std), "direction": f"direction {direction}", "reference": is_reference}
        for direction, series in values.items()
        for start, value, std, is_reference in series
    ]
    data = alt.Chart(_values(rows))
    x = alt.X("start:T", title=None).scale(type="utc", padding=6).axis(format="%Y-%m", tickCount=8)
    shape = alt.Shape("direction:N", title=None, legend=alt.Legend(orient="top", symbolFillColor=INK))
    bars = data.mark_rule(color=GREY, strokeWidth=0.6).encode(x, alt.Y("low:Q", title=title), y2="high:Q")
    later = data.mark_point(fill=INK, stroke=INK, strokeWidth=0.8, size=18, opacity=1)
    hollow = data.mark_point(fill="white", stroke=INK, strokeWidth=0.8, size=18, opacity=1)
    points = [
        one.transform_filter(f"datum.reference == {is_reference}").encode(x, alt.Y("value:Q", title=title), shape=shape)
        for one, is_reference in ((hollow, "true"), (later, "false"))
    ]
    zero = alt.Chart(_values([{"zero": 0.0}])).mark_rule(color=GREY, strokeWidth=0.8).encode(y="zero:Q")
    return _chart([zero, bars, *points], WIDE, 110)


def _panel(one: History, span: tuple[float, float], *, is_last: bool) -> alt.LayerChart:
    kept = extremes(one.values, POINTS)
    axis = alt.Axis(title="time after the start of the record (s)") if is_last else alt.Axis(labels=False, title=None)
    x = alt.X("time:Q", scale=alt.Scale(domain=list(span), nice=False), axis=axis)
    y = alt.Y("value:Q", title=None).axis(tickCount=3, minExtent=26)
    heading = alt.Title(one.title, anchor="start", fontSize=7.5, fontWeight=WEIGHT, offset=5)
    line = alt.Chart(_rows(time=one.time[kept], value=one.values[kept])).mark_line(color=INK, strokeWidth=0.6)
    return alt.LayerChart(layer=[line.encode(x, y)], title=heading, width=WIDE, height=34)


def _circle(radius: float, number: int, axes: Mapping[str, Any]) -> alt.Chart:
    angle = np.linspace(0.0, 2 * np.pi, 73)
    rows = _rows(x=radius * np.cos(angle), y=radius * np.sin(angle), n=angle)
    dashes = ([1, 0], [4, 2], [1, 2])[min(number, 2)]
    line: alt.Chart = alt.Chart(rows).mark_line(color=GREY, strokeWidth=1.6 if not number else 1, strokeDash=dashes)
    return line.encode(**axes, order="n:Q")


def _labels(circles: Sequence[tuple[str, float]], axes: Mapping[str, Any]) -> list[alt.Chart]:
    rows = [{"x": 0.0, "y": radius * MM, "name": name} for name, radius in circles]
    text = alt.Chart(_values(rows)).mark_text(dy=6, color=GREY, fontSize=6.5)
    return [text.encode(**axes, text="name:N")] if rows else []


def _loop(loop: tuple[Vector, Vector], colour: str, width: float, axes: Mapping[str, Any]) -> alt.Chart:
    displacement, force = loop
    kept = along_path(displacement, force, STEP)
    rows = _rows(displacement=displacement[kept] * MM, force=force[kept] * KN, n=kept.astype(float))
    line: alt.Chart = alt.Chart(rows).mark_line(color=colour, strokeWidth=width, strokeJoin="round").encode(**axes)
    return line


def _chart(layers: Sequence[alt.Chart], width: int, height: int) -> alt.LayerChart:
    return alt.LayerChart(layer=list(layers), width=width, height=height, config=dict(CONFIG))


def _mm(values: Vector) -> Iterable[float]:
    return (float(f"{value:.5g}") for value in values * MM)


def _rows(**columns: Vector) -> dict[str, Any]:
    names = list(columns)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return _values([dict(zip(names, (float(f"{v:.5g}") for v in row), strict=True)) for row in rows])


def _values(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Data of a chart as Vega-Lite has them: Altair would check every number, which takes longer than to draw it."""
    return {"values": rows}
