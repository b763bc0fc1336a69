"""Error that remains with each absent effect."""

from collections.abc import Sequence

import altair as alt

from core.workbench.candidates import Candidate
from service.models.workbench.figure import FAINT, INK, Figure, Rows, table, values
from service.reports.charts import BLUE, GREY, ORANGE

ROW = 22
"""Pixels of height for a candidate."""
KINDS = {"best, or cannot be distinguished from it": ORANGE, "other": BLUE, "implausible": GREY}


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
    caption = (
        "Remaining error with each effect that the model does not have, added alone and the whole model refitted. "
        f"Dashed: no effect added, {before:.3g}; grey line: noise alone. Orange: the best effect, and those that the "
        "records cannot distinguish from it. Effects at the dashed line do not help."
    )
    return Figure(
        "candidates", "Effects that would reduce the error", caption, alt.LayerChart(layer=layers), table(rows)
    )


def _kind(one: Candidate) -> str:
    if one.in_set:
        return "best, or cannot be distinguished from it"
    return "implausible" if one.implausible else "other"
