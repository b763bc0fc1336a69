"""Charts of one earthquake for engineers: waveforms, spectra, peaks over height, parts of the force, cycles, loops."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import altair as alt
import numpy as np

from core.arrays import Vector
from service.documents.charts import (
    BAND,
    BLUE,
    CONFIG,
    ESTIMATE,
    GREY,
    KN,
    KN_PER_MM,
    MM,
    ORANGE,
    STEP,
    brief,
    curves,
    shown_on_hover,
    values,
)
from service.documents.thinning import along_path, extremes

ENVELOPE = 1000
"""Points of a waveform: the extremes of every pixel of a phone, every second of a wide screen."""
SHOWN = {
    "acceleration": ("gal", 1e2),
    "velocity": ("cm/s", 1e2),
    "displacement": ("mm", MM),
    "temperature": ("°C", 1.0),
}
"""Unit of a quantity for people, and its number per SI unit."""
GAL, PERCENT = 1e2, 1e2
LOG_AXES = {"log": ["x", "y"]}
"""Metadata of a chart whose axes are both logarithmic or both linear, as the reader chooses."""
RIGID, MODAL = "moving as the base slab", "relative to the base slab"
MEASURED, ESTIMATED = "measured", "estimated"
THIS, OTHERS = "this earthquake", "other earthquakes"
TIME = "time after the start of the record (s)"
WIDTH = 820
"""Pixels, of a history."""

Rows = list[dict[str, Any]]
Expected = Callable[[alt.X, Callable[[str], alt.Y]], list[alt.Chart]]


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """An unbroken piece of a channel."""

    start: float
    """s after the start of the earthquake's record."""
    rate: float
    """Hz."""
    samples: Vector
    """(n,) SI units."""


def waveforms(channels: Mapping[str, tuple[str, Sequence[Trace]]]) -> alt.VConcatChart:
    """Channels as recorded, one below the other, each thinned to its extremes.

    Args:
        channels: quantity and pieces, in order of time, by the name to show.
    """
    panels = [
        _waveform(name, *SHOWN.get(quantity, (quantity, 1.0)), traces) for name, (quantity, traces) in channels.items()
    ]
    shown: alt.VConcatChart = alt.vconcat(*panels, spacing=8, config=CONFIG, title="Waveforms")
    return shown


def _waveform(name: str, unit: str, per_si: float, traces: Sequence[Trace]) -> alt.LayerChart:
    rows: Rows = []
    for number, trace in enumerate(traces):
        points = max(4, ENVELOPE // len(traces))
        rows += [
            {"piece": number, "time": brief(trace.start + at / trace.rate), "value": brief(trace.samples[at] * per_si)}
            for at in extremes(trace.samples, points)
            if np.isfinite(trace.samples[at])
        ]
    line = (
        alt.Chart(values(rows), width=WIDTH, height=110)
        .mark_line(color=BLUE, strokeWidth=1)
        .encode(
            x=alt.X("time:Q", title=TIME).scale(nice=False),
            y=alt.Y("value:Q", title=unit).scale(zero=False).axis(minExtent=45, tickCount=5),
            detail="piece:N",
            tooltip=shown_on_hover(time="time (s)", value=f"{name} ({unit})"),
        )
    )
    return alt.LayerChart(layer=[line], title=alt.Title(name, fontSize=12))


def spectra(by_name: Mapping[str, tuple[Sequence[float], Sequence[float]]]) -> alt.LayerChart:
    """Response spectra, 5 % damping.

    Args:
        by_name: periods (s) and pseudo-accelerations (m/s²), by the name of the curve.
    """
    rows: Rows = [
        {"curve": name, "period": brief(period), "value": brief(GAL * value)}
        for name, (periods, each) in by_name.items()
        for period, value in zip(periods, each, strict=True)
        if value > 0
    ]
    legend = alt.Legend(orient="bottom", columns=1, labelLimit=400)
    lines = (
        alt.Chart(values(rows))
        .mark_line(strokeWidth=1.6)
        .encode(
            x=alt.X("period:Q", title="period (s)").scale(type="log", nice=False),
            y=alt.Y("value:Q", title="pseudo-acceleration (gal)").scale(type="log", nice=False),
            color=alt.Color("curve:N", title=None, sort=list(by_name), legend=legend).scale(scheme="tableau10"),
            tooltip=[
                alt.Tooltip("curve:N", title="curve"),
                *shown_on_hover(period="period (s)", value="pseudo-acceleration (gal)"),
            ],
        )
    )
    title = alt.Title("Response spectra", subtitle="5 % damping")
    return alt.LayerChart(layer=[lines], title=title, width=460, height=340, config=CONFIG, usermeta=LOG_AXES)


def peaks_over_height(
    floors: Iterable[Mapping[str, Any]], storeys: Iterable[Mapping[str, Any]], heights: Mapping[str, float | None]
) -> alt.HConcatChart:
    """Largest acceleration of every floor, and largest drift of every storey.

    Args:
        floors: as of a stored ShakingResult, from the base slab up.
        storeys: the same, of the storeys.
        heights: m, of each storey by the level above it; where one is not known, displacements stand for drifts.
    """
    of_storeys = list(storeys)
    known = bool(of_storeys) and all(heights.get(one["level"]) for one in of_storeys)
    accelerations = [_peak(one, GAL) | {"is": MEASURED if one["is_measured"] else ESTIMATED} for one in floors]
    drifts = [
        _peak(one, PERCENT / (heights[one["level"]] or 1.0) if known else MM) | {"is": ESTIMATED} for one in of_storeys
    ]
    panels = [_over_height(accelerations, "largest acceleration (gal)", "level")]
    if drifts:
        label = "largest drift (% of the storey height)" if known else "largest storey displacement (mm)"
        panels.append(_over_height(drifts, label, "storey below"))
    shown: alt.HConcatChart = alt.hconcat(*panels, spacing=40, config=CONFIG, title="Peaks over height")
    return shown


def _peak(one: Mapping[str, Any], per_si: float) -> dict[str, Any]:
    std = one["std"] or 0.0
    peak = {"peak": one["peak"], "low": one["peak"] - 2 * std, "high": one["peak"] + 2 * std}
    return {"level": one["level"], "direction": one["direction"]} | {k: brief(v * per_si) for k, v in peak.items()}


def _over_height(rows: Rows, label: str, level: str) -> alt.LayerChart:
    order = list(dict.fromkeys(row["level"] for row in rows))[::-1]
    directions = sorted({row["direction"] for row in rows})
    up = alt.Y("level:N", sort=order, title=level)
    legend = alt.Legend(symbolOpacity=1.0)
    colour = alt.Color("direction:N", title="direction", legend=legend).scale(
        domain=directions, range=[BLUE, ORANGE][: len(directions)]
    )
    base = alt.Chart(values(rows), width=280, height=max(120, 34 * len(order)))
    bars = base.mark_rule(opacity=0.5).encode(up, alt.X("low:Q", title=label), alt.X2("high:Q"), color=colour)
    points = base.mark_point(size=60, opacity=1).encode(
        up,
        alt.X("peak:Q", title=label).scale(zero=True),
        color=colour,
        shape=alt.Shape("is:N", title=None).scale(domain=[MEASURED, ESTIMATED], range=["square", "circle"]),
        tooltip=[
            alt.Tooltip("level:N", title="level"),
            alt.Tooltip("direction:N", title="direction"),
            alt.Tooltip("is:N", title="is"),
            *shown_on_hover(peak=label, low="− 2 standard deviations", high="+ 2 standard deviations"),
        ],
    )
    return alt.LayerChart(layer=[bars, points])


def parts_of_force(*, time: Vector, force: Vector, std: Vector, rigid: Vector, modal: Vector) -> alt.VConcatChart:
    """The restoring force (N) over time (s) with its band of ± 2 standard deviations, and its two parts."""
    kept = extremes(force, ENVELOPE)
    whole: Rows = [
        {"time": brief(time[at]), "force": brief(force[at] * KN)}
        | {"low": brief((force[at] - 2 * std[at]) * KN), "high": brief((force[at] + 2 * std[at]) * KN)}
        for at in kept
    ]
    across = alt.X("time:Q", title=TIME).scale(nice=False)
    colour = curves({ESTIMATE: BLUE, BAND: ORANGE})
    base = alt.Chart(values(whole), width=WIDTH, height=170)
    band = (
        base.transform_calculate(curve=f"'{BAND}'")
        .mark_area(opacity=0.3)
        .encode(across, y="low:Q", y2="high:Q", color=colour)
    )
    hover = shown_on_hover(time="time (s)", force="force (kN)", low="from (kN)", high="to (kN)")
    line = (
        base.transform_calculate(curve=f"'{ESTIMATE}'")
        .mark_line(strokeWidth=1)
        .encode(across, alt.Y("force:Q", title="force (kN)").axis(minExtent=50), color=colour, tooltip=hover)
    )
    parts: Rows = [
        {"curve": name, "time": brief(time[at]), "force": brief(series[at] * KN)}
        for name, series in ((RIGID, rigid), (MODAL, modal))
        for at in extremes(series, ENVELOPE)
    ]
    below = (
        alt.Chart(values(parts), width=WIDTH, height=170)
        .mark_line(strokeWidth=1)
        .encode(
            across,
            alt.Y("force:Q", title="part of it (kN)").axis(minExtent=50),
            color=curves({RIGID: BLUE, MODAL: ORANGE}),
            tooltip=[
                alt.Tooltip("curve:N", title="curve"),
                *shown_on_hover(time="time (s)", force="part of the force (kN)"),
            ],
        )
    )
    panels = [alt.LayerChart(layer=[band, line]), alt.LayerChart(layer=[below])]
    shown: alt.VConcatChart = alt.vconcat(*panels, spacing=12, config=CONFIG, title="Restoring force and its parts")
    apart: alt.VConcatChart = shown.resolve_scale(color="independent")
    return apart


def cycles(
    rows: Iterable[Any], this: datetime, quantity: str, names: tuple[str, str], expected: Expected | None = None
) -> alt.LayerChart:
    """k_eq or c_eq of every cycle over its amplitude, those of one earthquake in colour.

    Args:
        rows: as of service.analyses.history.
        this: start of that earthquake.
        quantity: `k_eq` or `c_eq`.
        names: title, and label of the axis with its unit, kN/mm or kN s/mm.
        expected: draws what is expected along the axis of amplitudes and that of values, by its field.
    """
    title, label = names
    points: Rows = []
    for row in rows:
        value, std = getattr(row, quantity) * KN_PER_MM, getattr(row, f"{quantity}_std") * KN_PER_MM
        of = THIS if row.event_start == this else OTHERS
        points.append(
            {"event": f"{row.event_start:%Y-%m-%d %H:%M:%S}", "of": of, "amplitude": brief(row.amplitude * MM)}
            | {"value": brief(value), "std": brief(std), "low": brief(value - std), "high": brief(value + std)}
        )
    across = alt.X("amplitude:Q", title="displacement amplitude of the cycle (mm)").scale(
        type="log", nice=False, padding=12
    )

    def up(field: str) -> alt.Y:
        return alt.Y(f"{field}:Q", title=label).scale(zero=True)

    domain = alt.Scale(domain=[OTHERS, THIS], range=[GREY, ORANGE])
    colour = alt.Color("of:N", title=None, scale=domain, legend=alt.Legend(orient="top", symbolOpacity=1.0))
    hover = [alt.Tooltip("event:N", title="event (UTC)")]
    hover += shown_on_hover(amplitude="amplitude (mm)", value=label, std="standard deviation")
    layers: list[alt.Chart] = [] if expected is None else expected(across, up)
    for of, opacity in ((OTHERS, 0.6), (THIS, 1.0)):
        own = [row for row in points if row["of"] == of]
        if not own and points:  # a logarithmic axis of nothing has no extent
            continue
        base = alt.Chart(values(own))
        layers += [
            base.mark_rule(opacity=opacity / 2).encode(across, up("low"), alt.Y2("high:Q"), color=colour),
            base.mark_circle(size=50, opacity=opacity).encode(across, up("value"), color=colour, tooltip=hover),
        ]
    subtitle = "" if expected is None else "line and band: expected, 95 % of earthquakes"
    return alt.LayerChart(
        layer=layers,
        title=alt.Title(title, subtitle=subtitle),
        width=400,
        height=320,
        config=CONFIG,
        usermeta={"log": ["x"]},
    )


def overlaid_loops(
    by_name: Mapping[str, tuple[Vector, Vector]],
    title: str,
    rubber_height: float | None = None,
    rate: float | None = None,
) -> alt.LayerChart:
    """Loops of one or several earthquakes, with an axis of shear strain where the height of the rubber is known.

    Args:
        by_name: displacement (m) and force (N), by the name of the loop.
        title: of the chart.
        rubber_height: m.
        rate: Hz, of the samples, whose times are then shown.
    """
    largest = 1.05 * max((float(np.abs(u).max(initial=0.0)) for u, _ in by_name.values()), default=0.0) or 1e-3
    rows: Rows = [
        {"loop": name, "order": number, "displacement": brief(u[at] * MM), "force": brief(force[at] * KN)}
        | ({} if rate is None else {"time": brief(at / rate)})
        for name, (u, force) in by_name.items()
        for number, at in enumerate(along_path(u, force, STEP))
    ]
    reach = [brief(-largest * MM), brief(largest * MM)]
    hover = [] if rate is None else shown_on_hover(time="time (s)")
    hover += shown_on_hover(displacement="displacement (mm)", force="force (kN)")
    if rubber_height is not None:
        rows = [row | {"strain": brief(row["displacement"] / MM / rubber_height * PERCENT)} for row in rows]
        hover += shown_on_hover(strain="shear strain (%)")
    across = alt.X("displacement:Q", title="displacement of the isolation layer (mm)")
    colour = alt.Color("loop:N", title=None, sort=list(by_name), scale=alt.Scale(range=[BLUE, ORANGE]))
    lines = (
        alt.Chart(values(rows))
        .mark_line(strokeWidth=1.2, strokeJoin="round")
        .encode(
            across.scale(domain=reach, nice=False),
            alt.Y("force:Q", title="restoring force (kN)"),
            order="order:Q",
            color=colour if len(by_name) > 1 else alt.value(BLUE),
            tooltip=[*([alt.Tooltip("loop:N", title="earthquake")] if len(by_name) > 1 else []), *hover],
        )
    )
    shown = alt.LayerChart(layer=[lines], title=title, width=460, height=360, config=CONFIG)
    if rubber_height is None:
        return shown
    top = alt.X("displacement:Q", title="shear strain of the rubber (%)").axis(
        orient="top",
        labelExpr=f"format(datum.value / {MM * rubber_height / PERCENT:.6g}, '.3~g')",
        grid=False,
    )
    ends = alt.Chart(values([{"displacement": end} for end in reach])).mark_rule(opacity=0).encode(top)
    shown.layer = [ends, lines]
    apart: alt.LayerChart = shown.resolve_axis(x="independent")
    return apart
