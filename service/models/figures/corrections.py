"""Corrections of a model by each block of the records, and the error that remains with each absent effect."""

from collections.abc import Mapping, Sequence

import altair as alt
import numpy as np

from core.arrays import Vector
from core.comparison.block_corrections import BlockCorrection
from core.workbench.candidates import Candidate
from core.workbench.earthquakes import label
from service.documents.charts import (
    BLUE,
    FAINT,
    GREY,
    INK,
    KN,
    KN_PER_MM,
    MM,
    ORANGE,
    WIDTH,
    shown_on_hover,
    values,
)
from service.documents.document import Figure, Rows, numbers
from service.models import texts

HEIGHT = 300
"""Pixels."""
ROW = 22
"""Pixels of height for a candidate."""
FENCE = 3.0
"""Interquartile ranges beyond the quartiles at which an axis ends: the outer fences of Tukey (1977), Exploratory Data
Analysis."""
FLATTENED = 3.0
"""An axis ends at its fences if all points would need an axis so many times as long. A choice."""
FEW = 0.1
"""Largest share of points outside an axis, but always one; more are a group that the axis shows. A choice."""
SHAPES = {1: "triangle-up", -1: "triangle-down"}
BEST, OTHER, IMPLAUSIBLE = "best, or cannot be distinguished from it", "other", "implausible"
KINDS = {BEST: ORANGE, OTHER: BLUE, IMPLAUSIBLE: GREY}


def stiffness_over_amplitude(corrections: Sequence[BlockCorrection]) -> Figure | None:
    """Stiffness that each block would add to the model's; None where no block determines one."""
    directions = {one.direction for one in corrections}
    rows: Rows = [
        {
            "earthquake": label(one.earthquake, one.direction, directions),
            "amplitude (mm)": one.amplitude * MM,
            "correction (kN/mm)": one.stiffness * KN_PER_MM,
            "standard deviation (kN/mm)": one.stiffness_std * KN_PER_MM,
        }
        for one in corrections
    ]
    if not rows:
        return None
    across = alt.X("x:Q", title="amplitude of the block (mm)").scale(type="log", nice=False, padding=12)
    names = ("amplitude (mm)", "correction (kN/mm)", "standard deviation (kN/mm)")
    return _points("stiffness", rows, names, across, "stiffness correction (kN/mm)")


def yield_over_travel(corrections: Sequence[BlockCorrection]) -> Figure | None:
    """Yield force that each block would add to the model's; None where no block determines one."""
    directions = {one.direction for one in corrections}
    rows: Rows = [
        {
            "earthquake": label(one.earthquake, one.direction, directions),
            "travel (m)": one.travel,
            "correction (kN)": one.yield_force * KN,
            "standard deviation (kN)": one.yield_std * KN,
        }
        for one in corrections
        if one.yield_force is not None and one.yield_std is not None
    ]
    if not rows:
        return None
    across = alt.X("x:Q", title="travel since the first record (m)").scale(nice=False, padding=12)
    names = ("travel (m)", "correction (kN)", "standard deviation (kN)")
    return _points("yield", rows, names, across, "yield force correction (kN)")


def candidates(tried: Sequence[Candidate], before: float) -> Figure | None:
    """Noise ratio of the model with each effect.

    Args:
        tried: the best first.
        before: the same of the model without any.
    """
    if not tried:
        return None
    rows: Rows = [
        {
            "effect": one.effect,
            "family": one.family,
            "noise ratio of the residual": one.noise_ratio,
            "ΔBIC": one.delta_bic,
            "kind": _kind(one),
            "reason": one.implausible or "",
        }
        for one in tried
    ]
    plain: Rows = [
        {
            "effect": row["effect"],
            "left": min(row["noise ratio of the residual"], before),
            "kind": row["kind"],
            "before": before,
            **{name: row[name] for name in ("family", "noise ratio of the residual", "ΔBIC", "reason")},
        }
        for row in rows
    ]
    y = alt.Y("effect:N", sort=None, title=None)
    scale = alt.Scale(domain=list(KINDS), range=list(KINDS.values()))
    legend = alt.Legend(title=None, orient="top", labelLimit=300)
    base = alt.Chart(values(plain), width=600, height=ROW * len(plain))
    layers = [
        base.mark_rule(color=FAINT, opacity=0.5).encode(y, alt.X("left:Q"), alt.X2("before:Q")),
        base.mark_circle(size=110, opacity=1.0).encode(
            y,
            alt.X("left:Q", title="noise ratio of the residual").scale(zero=False, nice=False, padding=15),
            color=alt.Color("kind:N", scale=scale, legend=legend),
            tooltip=[
                alt.Tooltip("effect:N", title="effect"),
                alt.Tooltip("family:N", title="family"),
                *shown_on_hover("noise ratio of the residual", "ΔBIC"),
                alt.Tooltip("reason:N", title="implausible because"),
            ],
        ),
        alt.Chart(values([{"x": before, "name": "without any"}]))
        .mark_rule(color=INK, strokeDash=[5, 4])
        .encode(x="x:Q"),
        alt.Chart(values([{"x": 1.0}])).mark_rule(color=GREY, strokeWidth=2).encode(x="x:Q"),
    ]
    title, caption = texts.FIGURES["candidates"]
    return Figure("candidates", title, caption.format(before=before), (alt.LayerChart(layer=layers),), numbers(rows))


def robust_range(values: Vector, std: Vector) -> tuple[float, float]:
    """Ends of an axis that a few distant points do not stretch; zero is between them.

    Args:
        values: (n,) any unit, one at least.
        std: (n,) standard deviations.
    """
    low, high = min(0.0, float((values - std).min())), max(0.0, float((values + std).max()))
    quarter, three_quarters = np.quantile(values, [0.25, 0.75])
    reach = FENCE * (three_quarters - quarter)
    bottom, top = max(low, min(0.0, float(quarter - reach))), min(high, max(0.0, float(three_quarters + reach)))
    outside = np.count_nonzero((values < bottom) | (values > top))
    is_flattened = high - low > FLATTENED * (top - bottom)
    return (bottom, top) if is_flattened and 0 < outside <= max(1, FEW * values.size) else (low, high)


def _points(key: str, rows: Rows, names: tuple[str, str, str], across: alt.X, up: str) -> Figure:
    """Corrections with their standard deviations; points outside the axis are triangles at its edge."""
    x, y, std = names
    bottom, top = robust_range(*(np.array([row[name] for row in rows]) for name in (y, std)))
    plain: Rows = [
        {"earthquake": row["earthquake"], "x": row[x], "y": min(max(row[y], bottom), top)}
        | {"low": max(row[y] - row[std], bottom), "high": min(row[y] + row[std], top)}
        | {"value": row[y], "std": row[std]}
        for row in rows
    ]
    sides = [int(row[y] > top) - int(row[y] < bottom) for row in rows]
    scale = alt.Scale(domain=[bottom, top], nice=False) if any(sides) else alt.Scale()
    hover = [alt.Tooltip("earthquake:N", title="earthquake (UTC)"), *shown_on_hover(x=x, value=y, std=std)]
    picture = _scatter({side: _only(side, plain, sides) for side in (0, 1, -1)}, across, up, scale, hover)
    title, caption = texts.FIGURES[key]
    if any(sides):
        remark = texts.outside_axis([row[y] for row, side in zip(rows, sides, strict=True) if side], len(rows), y)
        picture = picture.properties(title=alt.Title(remark, fontSize=12, fontWeight="normal"))
        caption = f"{caption} {remark} {texts.ROBUST_AXIS.format(fence=FENCE)}"
        rows = [row | {"on the axis": "no" if side else "yes"} for row, side in zip(rows, sides, strict=True)]
    return Figure(key, title, caption, (picture,), numbers(rows))


def _only(side: int, rows: Rows, sides: Sequence[int]) -> Rows:
    return [row for row, its in zip(rows, sides, strict=True) if its == side]


def _scatter(
    sides: Mapping[int, Rows], across: alt.X, up: str, scale: alt.Scale, hover: list[alt.Tooltip]
) -> alt.LayerChart:
    """Points with bars.

    Args:
        sides: points on the axis at 0; those above and below, moved to its edge, at 1 and −1.
        across: horizontal axis.
        up: title of the vertical axis.
        scale: its scale.
        hover: what a point shows.
    """
    legend = alt.Legend(symbolOpacity=1.0, symbolType="circle")
    colour = alt.Color("earthquake:N", title="earthquake (UTC)", legend=legend).scale(scheme="tableau10")
    low, vertical = (alt.Y(f"{name}:Q", title=up, scale=scale) for name in ("low", "y"))
    base = alt.Chart(values(sides[0]), width=WIDTH * 0.75, height=HEIGHT)
    zero = alt.Chart(values([{"y": 0}])).mark_rule(color=FAINT).encode(vertical)
    bars = base.mark_rule(opacity=0.4).encode(across, low, alt.Y2("high:Q"), color=colour)
    points = base.mark_circle(size=45, opacity=0.85).encode(across, vertical, color=colour, tooltip=hover)
    edges = [
        alt.Chart(values(sides[side]))
        .mark_point(shape=shape, filled=True, size=110, opacity=1.0)
        .encode(across, vertical, color=colour, tooltip=hover)
        for side, shape in SHAPES.items()
        if sides[side]
    ]
    return alt.LayerChart(layer=[zero, bars, *edges, points])


def _kind(one: Candidate) -> str:
    if one.in_set:
        return BEST
    return IMPLAUSIBLE if one.implausible else OTHER
