"""Corrections of a model by each block of the records, over amplitude and over travel."""

from collections.abc import Sequence

import altair as alt

from core.comparison.block_corrections import BlockCorrection
from core.workbench.earthquakes import label
from service.models.workbench.figure import FAINT, WIDTH, Figure, Rows, table, values
from service.reports.charts import KN, KN_PER_MM, MM

HEIGHT = 300
"""Pixels."""


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
    caption = (
        "Each point is a block of 5 s: its correction of the model's stiffness, with its standard deviation. A correct "
        "model's points scatter about zero at every amplitude. A trend with amplitude shows a missing law or a wrong "
        "yield force. An offset between earthquakes shows a change between them: past motion, temperature, a step."
    )
    across = alt.X("x:Q", title="amplitude of the block (mm)").scale(type="log", nice=False, padding=12)
    names = ("amplitude (mm)", "correction (kN/mm)", "standard deviation (kN/mm)")
    picture = _points(rows, names, across, "stiffness correction (kN/mm)")
    return Figure("stiffness", "Stiffness correction over amplitude", caption, picture, table(rows))


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
    caption = (
        "Correction of the model's yield force by each block in which the layer yields, over the layer's total travel. "
        "Heating lowers the yield force during an earthquake, and it recovers before the next; after degradation it "
        "does not recover."
    )
    across = alt.X("x:Q", title="travel since the first record (m)").scale(nice=False, padding=12)
    picture = _points(
        rows, ("travel (m)", "correction (kN)", "standard deviation (kN)"), across, "yield force correction (kN)"
    )
    return Figure("yield", "Yield correction over travel", caption, picture, table(rows))


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
