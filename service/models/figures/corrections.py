"""Corrections of a model by each block of the records, and the error that remains with each absent effect."""

from collections.abc import Sequence

import altair as alt

from core.comparison.block_corrections import BlockCorrection
from core.workbench.candidates import Candidate
from core.workbench.earthquakes import label
from service.models import texts
from service.reports.charts import BLUE, FAINT, GREY, INK, KN, KN_PER_MM, MM, ORANGE, WIDTH, values
from service.reports.document import Figure, Rows, numbers

HEIGHT = 300
"""Pixels."""
ROW = 22
"""Pixels of height for a candidate."""
KINDS = {"best, or cannot be distinguished from it": ORANGE, "other": BLUE, "implausible": GREY}


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
    picture = _points(rows, names, across, "stiffness correction (kN/mm)")
    return Figure("stiffness", *texts.FIGURES["stiffness"], (picture,), numbers(rows))


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
    picture = _points(
        rows, ("travel (m)", "correction (kN)", "standard deviation (kN)"), across, "yield force correction (kN)"
    )
    return Figure("yield", *texts.FIGURES["yield"], (picture,), numbers(rows))


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
            alt.X("left:Q", title="noise ratio of the residual").scale(zero=False, nice=True, padding=15),
            color=alt.Color("kind:N", scale=scale, legend=legend),
        ),
        alt.Chart(values([{"x": before, "name": "without any"}]))
        .mark_rule(color=INK, strokeDash=[5, 4])
        .encode(x="x:Q"),
        alt.Chart(values([{"x": 1.0}])).mark_rule(color=GREY, strokeWidth=2).encode(x="x:Q"),
    ]
    title, caption = texts.FIGURES["candidates"]
    return Figure("candidates", title, caption.format(before=before), (alt.LayerChart(layer=layers),), numbers(rows))


def _points(rows: Rows, names: tuple[str, str, str], across: alt.X, up: str) -> alt.LayerChart:
    x, y, std = names
    plain: Rows = [
        {"earthquake": row["earthquake"], "x": row[x], "y": row[y]}
        | {"low": row[y] - row[std], "high": row[y] + row[std]}
        for row in rows
    ]
    legend = alt.Legend(symbolOpacity=1.0)
    colour = alt.Color("earthquake:N", title="earthquake (UTC)", legend=legend).scale(scheme="tableau10")
    base = alt.Chart(values(plain), width=WIDTH * 0.75, height=HEIGHT)
    zero = alt.Chart(values([{"y": 0}])).mark_rule(color=FAINT).encode(y="y:Q")
    bars = base.mark_rule(opacity=0.4).encode(across, alt.Y("low:Q", title=up), alt.Y2("high:Q"), color=colour)
    points = base.mark_circle(size=45, opacity=0.85).encode(across, alt.Y("y:Q", title=up), color=colour)
    return alt.LayerChart(layer=[zero, bars, points])


def _kind(one: Candidate) -> str:
    if one.in_set:
        return "best, or cannot be distinguished from it"
    return "implausible" if one.implausible else "other"
