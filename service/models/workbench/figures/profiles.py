"""The excess error of a model over each covariate."""

from collections.abc import Sequence
from itertools import pairwise

import altair as alt

from core.comparison.profile import Profile
from core.rounding import plain
from service.models.workbench.figure import FAINT, INK, Figure, Rows, table, values
from service.reports.charts import BLUE, MM

UNITS = {
    "amplitude": ("amplitude (mm)", MM),
    "velocity": ("velocity (mm/s)", MM),
    "largest past displacement": ("largest past displacement (mm)", MM),
    "travel": ("travel in the earthquake (m)", 1.0),
    "cycle": ("cycle", 1.0),
    "time": ("time in the record (s)", 1.0),
    "other direction": ("other direction (mm)", MM),
    "vertical load": ("vertical load / weight", 1.0),
    "temperature": ("temperature (°C)", 1.0),
    "frequency": ("frequency (Hz)", 1.0),
}
"""Label, and users' unit per SI unit, of every covariate that is a number."""


def shares(profiles: Sequence[Profile]) -> Figure | None:
    """Share of the excess error over every covariate that is a number, beside the share of the force's energy."""
    numbers = [one for one in profiles if not one.classes and one.name in UNITS]
    parts = [_profile(one) for one in numbers]
    if not parts:
        return None
    panels = [_bars(rows, UNITS[one.name][0]) for one, rows in zip(numbers, parts, strict=True)]
    caption = (
        "Bars: share of the excess error, with its 95 % interval; grey ticks: share of the force's energy, where an "
        "error in proportion to the force would lie. A bar far above its tick is where the model fails."
    )
    picture = alt.concat(*panels, columns=3, spacing=26)
    return Figure(
        "where", "Where the excess error lies", caption, picture, table([row for one in parts for row in one])
    )


def _profile(one: Profile) -> Rows:
    unit = UNITS[one.name][1]
    names = _ranges([*(part.low * unit for part in one.bins), one.bins[-1].high * unit])
    return [
        {
            "circumstance": one.name,
            "range": name,
            "from": part.low * unit,
            "share of the excess (%)": 100 * part.share.value,
            "low (%)": 100 * part.share.low,
            "high (%)": 100 * part.share.high,
            "share of the force's energy (%)": 100 * part.energy,
            "noise ratio": part.noise_ratio,
        }
        for name, part in zip(names, one.bins, strict=True)
    ]


def _ranges(edges: Sequence[float]) -> list[str]:
    """Names of the ranges between inner edges, with as few digits as distinguish them."""
    inner = edges[1:-1]
    digits = next((d for d in range(2, 9) if len({plain(edge, d) for edge in inner}) == len(inner)), 9)
    told = [plain(edge, digits) for edge in inner]
    if not told:
        return ["all"]
    return [f"< {told[0]}", *(f"{low} – {high}" for low, high in pairwise(told)), f"> {told[-1]}"]


def _bars(rows: Rows, label: str) -> alt.LayerChart:
    plain: Rows = [
        {"range": row["range"], "share": row["share of the excess (%)"], "low": row["low (%)"], "high": row["high (%)"]}
        | {"energy": row["share of the force's energy (%)"]}
        for row in rows
    ]
    x = alt.X("range:N", title=label, sort=None).axis(labelAngle=-40, labelLimit=90)
    base = alt.Chart(values(plain), width=230, height=130)
    layers = [
        base.mark_bar(color=BLUE, opacity=0.75).encode(x, alt.Y("share:Q", title="share (%)")),
        base.mark_tick(color=FAINT, thickness=2, width=24).encode(x, alt.Y("energy:Q")),
        base.mark_rule(color=INK).encode(x, alt.Y("low:Q"), alt.Y2("high:Q")),
    ]
    return alt.LayerChart(layer=layers)
