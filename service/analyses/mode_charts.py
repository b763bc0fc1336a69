"""The pictures of modes over events: frequency and damping over time and over the strength of the shaking."""

from collections.abc import Sequence

import altair as alt

from service.analyses.mode_tracks import Sighting, TrackedMode
from service.reports.charts import BLUE, CONFIG, KN

PERCENT = 1e2
MARGIN = 0.05
"""Margin above and below the values, as a fraction of a panel's height."""
WIDEST = 42
"""Pixels that the numbers of an axis may take, so that the panels stand in columns."""
FREQUENCY, DAMPING = "frequency (Hz)", "damping ratio (%)"
TIME, FORCE = "event (UTC)", "peak restoring force (kN)"


def modes_over_events(modes: Sequence[TrackedMode], title: str) -> alt.VConcatChart:
    """A row of four panels for each mode, at least one; bars are ± 1 standard deviation."""
    rows = [_panels(mode) for mode in modes]
    heading = alt.Title(title, subtitle="bars are ± 1 standard deviation", offset=14)
    return alt.vconcat(*rows, title=heading, spacing=30, config=CONFIG)


def _panels(mode: TrackedMode) -> alt.HConcatChart:
    rows = [_row(sighting) for sighting in mode.sightings]
    panels = [_panel(rows, value, across) for value in (FREQUENCY, DAMPING) for across in (TIME, FORCE)]
    heading = alt.Title(f"Mode {mode.number}: {mode.frequency:.3g} Hz, {mode.damping_ratio * PERCENT:.2g} %")
    return alt.hconcat(*panels, title=heading, spacing=18)


def _panel(rows: Sequence[dict[str, float]], value: str, across: str) -> alt.LayerChart:
    data, name = alt.InlineData(values=rows), "frequency" if value == FREQUENCY else "damping"
    low, high = min(row[f"{name}_low"] for row in rows), max(row[f"{name}_high"] for row in rows)
    # Of a bar's two ends only one would be counted by itself.
    scale = alt.Scale(domain=[low - MARGIN * (high - low), high + MARGIN * (high - low)], zero=False, nice=False)
    x = (
        alt.X("start:T", title=across, axis=alt.Axis(format="%Y-%m", tickCount=3)).scale(type="utc", padding=10)
        if across == TIME
        else alt.X("force:Q", title=across, axis=alt.Axis(tickCount=3)).scale(type="log", nice=False, padding=10)
    )
    y = alt.Y(f"{name}_low:Q", title=value, scale=scale, axis=alt.Axis(minExtent=WIDEST, tickCount=5))
    bars = alt.Chart(data).mark_rule(color=BLUE, opacity=0.4).encode(x, y, y2=f"{name}_high:Q")
    points = alt.Chart(data).mark_circle(color=BLUE, size=36, opacity=0.8).encode(x, alt.Y(f"{name}:Q", title=value))
    return alt.LayerChart(layer=[bars, points], width=200, height=150)


def _row(sighting: Sighting) -> dict[str, float]:
    mode = sighting.mode
    frequency_std, damping_std = mode.frequency_std or 0.0, mode.damping_ratio_std or 0.0
    return {
        "start": sighting.event_start.timestamp() * 1e3,
        "force": sighting.peak_force * KN,
        "frequency": mode.frequency,
        "frequency_low": mode.frequency - frequency_std,
        "frequency_high": mode.frequency + frequency_std,
        "damping": mode.damping_ratio * PERCENT,
        "damping_low": (mode.damping_ratio - damping_std) * PERCENT,
        "damping_high": (mode.damping_ratio + damping_std) * PERCENT,
    }
