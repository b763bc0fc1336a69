"""The paper's kinds of figures: histories, loops, mode shapes."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np

from core.arrays import Indices, Vector
from core.estimators import ESTIMATORS
from service.documents.charts import BLUE, GREY, ORANGE, STEP
from service.documents.document import Figure
from service.documents.thinning import along_path, extremes

POINTS = 1760
"""Samples of a history: two for each pixel of its width."""
WIDTH, HEIGHT, SIDE = 880, 120, 380
"""Pixels: of histories, and of a loop or a mode shape."""
ALIGNED = 50
"""Pixels left of every history, so that those below one another share their time."""
COLOURS = (BLUE, ORANGE, "#2e8b57", "#8e44ad")
"""Colours of the estimators, in their order; the exact curve is grey."""
EXACT = "exact"
TIME = "time after the start of the record (s)"
DISPLACEMENT = "displacement of the isolation layer (mm)"
FORCE = "restoring force (kN)"


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One line of a panel."""

    name: str
    values: Vector
    """(n,) in the unit that is drawn."""
    colour: str = BLUE
    width: float = 1.2


def figure(number: int, title: str, caption: str, panels: Sequence[alt.LayerChart]) -> Figure:
    """One of the paper's figures, drawn anew.

    Args:
        number: the paper's.
        title: of the figure.
        caption: contents of the figure, and its comparison with the paper.
        panels: its pictures.
    """
    return Figure(f"figure-{number}", f"Figure {number}. {title}", caption, tuple(panels))


def exact(values: Vector) -> Curve:
    """The curve against which others are seen: thick and grey, below them."""
    return Curve(EXACT, values, GREY, 3.0)


def estimates(values: Mapping[str, Vector]) -> tuple[Curve, ...]:
    """A curve for each estimator that has one."""
    colours = dict(zip(ESTIMATORS, COLOURS, strict=False))
    return tuple(Curve(name, series, colours.get(name, "black")) for name, series in values.items())


def strongest(values: Vector, rate: float, seconds: float) -> slice:
    """The window of that length with the most energy; all where the record is shorter."""
    length = round(seconds * rate)
    if length >= values.size:
        return slice(0, values.size)
    energy = np.concatenate([[0.0], np.cumsum(values**2)])
    start = int(np.argmax(energy[length:] - energy[:-length]))
    return slice(start, start + length)


def histories(
    time: Vector, curves: Sequence[Curve], label: str, *, title: str = "", height: int = HEIGHT
) -> alt.LayerChart:
    """Curves over time (s), each thinned to what can be seen."""
    layers = [
        _named(curve, _rows(extremes(curve.values, POINTS), x=time, y=curve.values))
        .mark_line(strokeWidth=curve.width, strokeJoin="round")
        .encode(
            x=alt.X("x:Q", title=TIME).scale(nice=False, zero=False),
            y=alt.Y("y:Q", title=label).axis(minExtent=ALIGNED),
            color=_colour(curve, curves),
        )
        for curve in curves
    ]
    return alt.LayerChart(layer=layers, title=title, width=WIDTH, height=height)


def loops(displacement: Vector, curves: Sequence[Curve], *, title: str = "") -> alt.LayerChart:
    """Forces (kN) over displacement (mm)."""
    layers = [
        _named(c, _rows(along_path(displacement, c.values, STEP), x=displacement, y=c.values, t=_order(displacement)))
        .mark_line(strokeWidth=c.width, strokeJoin="round")
        .encode(x=alt.X("x:Q", title=DISPLACEMENT), y=alt.Y("y:Q", title=FORCE), order="t:Q", color=_colour(c, curves))
        for c in curves
    ]
    return alt.LayerChart(layer=layers, title=title, width=SIDE, height=SIDE)


def profiles(levels: Sequence[str], curves: Sequence[Curve], measured: Sequence[int], title: str) -> alt.LayerChart:
    """Mode shapes over the height.

    Args:
        levels: names, the base slab first.
        curves: (levels,) values each, 0 at the base slab.
        measured: indices of the levels with a sensor.
        title: of the panel.
    """
    names = f"{json.dumps(list(levels))}[datum.value]"
    axis = alt.Axis(values=list(range(len(levels))), labelExpr=names, title="level", grid=False)
    height = np.arange(len(levels), dtype=float)
    layers = []
    for curve in curves:
        rows = _rows(np.arange(len(levels)), x=curve.values, y=height)
        marks = _rows(np.array(measured, dtype=np.intp), x=curve.values, y=height)
        line = _named(curve, rows).mark_line(strokeWidth=curve.width)
        point = _named(curve, marks).mark_point(filled=True, size=45, opacity=1)
        for chart in (line, point) if curve.name != EXACT else (line,):
            x, y = alt.X("x:Q", title="mode shape, the roof being 1"), alt.Y("y:Q", axis=axis)
            layers.append(chart.encode(x=x, y=y, order="y:Q", color=_colour(curve, curves)))
    return alt.LayerChart(layer=layers, title=title, width=SIDE, height=SIDE)


def _named(curve: Curve, rows: alt.InlineData) -> alt.Chart:
    """A chart of rows that all bear the curve's name."""
    chart: alt.Chart = alt.Chart(rows).transform_calculate(name=json.dumps(curve.name))
    return chart


def _order(values: Vector) -> Vector:
    return np.arange(values.size, dtype=float)


def _colour(curve: Curve, curves: Sequence[Curve]) -> alt.Color:
    """The curve's own, with a legend where there is more than one."""
    scale = alt.Scale(domain=[c.name for c in curves], range=[c.colour for c in curves])
    legend = alt.Legend(title=None, orient="top", symbolType="stroke") if len(curves) > 1 else None
    return alt.Color("name:N", scale=scale, legend=legend)


def _rows(kept: Indices, **columns: Vector) -> alt.InlineData:
    """The kept samples to five digits: more are not seen. As CSV: Altair checks records one by one, for seconds."""
    lines = (
        ",".join(f"{value:.5g}" for value in row) for row in zip(*(c[kept] for c in columns.values()), strict=True)
    )
    form = alt.CsvDataFormat(type="csv", parse=dict.fromkeys(columns, "number"))  # unsaid, an order would be of words
    return alt.InlineData(values="\n".join([",".join(columns), *lines]), format=form)
