"""Pictures of drift: the baseline over amplitude, and the events' deviations from it over the years."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import altair as alt

from core.drift.quantities import BOTH_DIRECTIONS
from core.drift.rules import RECOVERY, SLOW, SUDDEN
from core.rounding import supported
from service.analyses.mode_tracks import DIRECTIONS
from service.documents.charts import BLUE, CONFIG, DARK_ORANGE, KN, KN_PER_MM, LOG_OR_LINEAR, MM, ORANGE, values
from service.drift.schema import BaselineOut, CurvePoint, DriftAlarmRow, DriftRow, ObservationRow

PERCENT = 1e2
WIDEST = 46
"""Pixels that the numbers of an axis may take, so that panels are aligned."""
MARGIN = 0.08
"""Share of a panel's height that stays free above and below its contents."""


@dataclass(frozen=True, slots=True)
class Axes:
    """Titles of a curve's axes, and factors from SI units to theirs."""

    value: str
    value_scale: float
    amplitude: str
    amplitude_scale: float


CURVES: Mapping[str, Axes] = MappingProxyType(
    {
        "stiffness": Axes("equivalent stiffness (kN/mm)", KN_PER_MM, "amplitude (mm)", MM),
        "damping": Axes("equivalent damping (kN s/mm)", KN_PER_MM, "amplitude (mm)", MM),
        "frequency": Axes("frequency (Hz)", 1.0, "peak restoring force (kN)", KN),
        "model_error": Axes("error of the model's force (%)", PERCENT, "peak displacement (mm)", MM),
    }
)
"""Axes by quantity; quantities without an amplitude have no curve."""
HISTORIES: Mapping[str, tuple[str, float]] = MappingProxyType({"residual_displacement": ("change (mm)", MM)})
RELATIVE = ("change (%)", PERCENT)
LABELS: Mapping[str, str] = {SUDDEN: "sudden {size}", SLOW: "slow {size}", RECOVERY: "recovery {size}"}
"""Text beside the onset of an alarm, by its rule."""
OLDER = "#8a929c"
SHADES = ((OLDER, True), (OLDER, False), (BLUE, True), (BLUE, False))
"""Colour and filling of events: of the reference or later, tested or not."""


def expectation(known: BaselineOut, latest: Sequence[ObservationRow], title: str) -> alt.LayerChart:
    """The curve with its band, and the measurements of the latest event; bars are ± 1 standard deviation."""
    axes = CURVES[known.quantity]
    points = values([_point_row(one, axes) for one in latest if one.amplitude is not None])
    x = alt.X("amplitude:Q", title=axes.amplitude).scale(type="log", nice=False).axis(tickCount=6, labelOverlap=True)

    def y(field: str) -> alt.Y:
        return alt.Y(f"{field}:Q", title=axes.value).scale(zero=False).axis(minExtent=WIDEST)

    bars = alt.Chart(points).mark_rule(color=ORANGE).encode(x, y("low"), y2="high:Q")
    tooltip = [
        alt.Tooltip("amplitude:Q", title=axes.amplitude, format=".3~g"),
        alt.Tooltip("value:Q", title=axes.value, format=".4~g"),
    ]
    dots = alt.Chart(points).mark_circle(color=ORANGE, size=40, opacity=1).encode(x, y("value"), tooltip=tooltip)
    when = f" at {known.temperature:.0f} °C" if known.temperature is not None else ""
    heading = alt.Title(title, subtitle=f"line and band: expected{when}, 95 % of events; orange: the latest event")
    layers = [*expected(known, x, y), bars, dots]
    chart = alt.LayerChart(layer=layers, title=heading, width=460, height=300, config=CONFIG)
    return chart.properties(usermeta=LOG_OR_LINEAR)


def expected(known: BaselineOut, x: alt.X, y: Callable[[str], alt.Y]) -> list[alt.Chart]:
    """The curve with its band, dashed beyond the amplitudes of the reference.

    Args:
        known: a baseline with a curve.
        x: the axis of amplitudes.
        y: the axis of values, of a field.
    """
    axes = CURVES[known.quantity]
    curve = values([_curve_row(point, axes) for point in known.items])
    seen = values([_curve_row(point, axes) for point in known.items if point.is_seen])
    tooltip = [
        alt.Tooltip(f"{field}:Q", title=title, format=".4~g")
        for field, title in {
            "amplitude": axes.amplitude,
            "expected": f"expected {axes.value}",
            "low": "from",
            "high": "to",
        }.items()
    ]
    band = alt.Chart(curve).mark_area(color=BLUE, opacity=0.18).encode(x, y("low"), y2="high:Q")
    beyond = (
        alt.Chart(curve)
        .mark_line(color=BLUE, strokeWidth=1, strokeDash=[3, 3])
        .encode(x, y("expected"), tooltip=tooltip)
    )
    return [band, beyond, alt.Chart(seen).mark_line(color=BLUE, strokeWidth=2).encode(x, y("expected"))]


def history(
    quantity: str,
    changes: Mapping[str, Sequence[DriftRow]],
    alarms: Mapping[str, Sequence[DriftAlarmRow]],
    title: str,
) -> alt.VConcatChart:
    """A panel for each subject, one at least: changes over time, with the alarms and their onsets.

    Args:
        quantity: one of core.drift.quantities.
        changes: by subject, each with one at least.
        alarms: by subject.
        title: title of the picture.
    """
    axis, scale = HISTORIES.get(quantity, RELATIVE)
    panels = [_panel(subject, rows, alarms.get(subject, ()), axis, scale) for subject, rows in changes.items()]
    legend = "bars: ± 1 standard deviation; grey: reference; hollow: not tested; orange: alarm with its 95 % interval"
    return alt.vconcat(*panels, title=alt.Title(title, subtitle=legend, offset=12), spacing=14, config=CONFIG)


def titled(quantity: str, subject: str) -> str:
    """A quantity with its subject in words."""
    direction, _, mode = subject.partition("/")
    if mode and direction in DIRECTIONS:
        return f"{quantity}, direction {direction}, mode {mode}"
    return f"{quantity}, {named(subject)}"


def named(subject: str) -> str:
    """A direction or a mode in words; a channel by its id."""
    if subject == BOTH_DIRECTIONS:
        return "both directions"
    direction, _, mode = subject.partition("/")
    if direction not in DIRECTIONS:
        return subject
    return f"direction {direction}, mode {mode}" if mode else f"direction {direction}"


def _panel(
    subject: str, rows: Sequence[DriftRow], alarms: Sequence[DriftAlarmRow], axis: str, scale: float
) -> alt.LayerChart:
    drawn = [_value_row(row, scale) for row in rows]
    unit = axis.rpartition("(")[2].removesuffix(")")
    marked = [_alarm_row(alarm, drawn[-1]["start"], scale, unit) for alarm in alarms]
    heights = [0.0, *(row[name] for row in (*drawn, *marked) for name in ("low", "high"))]
    spare = MARGIN * (max(heights) - min(heights))
    vertical = alt.Scale(domain=[min(heights) - spare, max(heights) + spare], nice=False, zero=False)
    x = alt.X("start:T", title="event (UTC)", axis=alt.Axis(format="%Y-%m", tickCount=6)).scale(type="utc", padding=10)
    y = alt.Y("low:Q", title=axis, scale=vertical, axis=alt.Axis(minExtent=WIDEST, tickCount=5))
    zero = alt.Chart(values([{"low": 0.0}])).mark_rule(color="#555").encode(y)
    layers = [*_alarms(marked, x, y), zero, *(_points(drawn, shade, filled, x, y, axis) for shade, filled in SHADES)]
    return alt.LayerChart(layer=layers, title=alt.Title(named(subject), fontSize=13), width=640, height=130)


def _alarms(rows: Sequence[Mapping[str, object]], x: alt.X, y: alt.Y) -> list[alt.Chart]:
    """From the onset on, the interval of each drift with its size."""
    chart = alt.Chart(values(rows))
    return [
        chart.mark_rect(color=ORANGE, opacity=0.22).encode(x, y, x2="end:T", y2="high:Q"),
        chart.mark_rule(color=ORANGE, strokeDash=[5, 3], strokeWidth=1.5).encode(x),
        chart.mark_text(align="left", dx=4, color=DARK_ORANGE, fontSize=12).encode(x, y=alt.value(9), text="label:N"),
    ]


def _points(
    rows: Sequence[Mapping[str, object]], shade: str, filled: bool, x: alt.X, y: alt.Y, title: str
) -> alt.LayerChart:
    """Points of one kind, with their bars."""
    own = [row for row in rows if (row["shade"], row["is_tested"]) == (shade, filled)]
    data = alt.Chart(values(own))
    bars = data.mark_rule(color=shade, opacity=0.6).encode(x, y, y2="high:Q")
    marks = data.mark_point(stroke=shade, fill=shade if filled else "white", size=34, opacity=1)
    tooltip = [
        alt.Tooltip("start:T", title="event (UTC)", format="%Y-%m-%d %H:%M:%S"),
        alt.Tooltip("value:Q", title=title, format=".3~g"),
        alt.Tooltip("low:Q", title="from", format=".3~g"),
        alt.Tooltip("high:Q", title="to", format=".3~g"),
    ]
    return alt.LayerChart(layer=[bars, marks.encode(x, alt.Y("value:Q"), tooltip=tooltip)])


def _value_row(row: DriftRow, scale: float) -> dict[str, Any]:
    return {
        "start": row.event_start.timestamp() * 1e3,
        "value": row.value * scale,
        "low": (row.value - row.std) * scale,
        "high": (row.value + row.std) * scale,
        "shade": OLDER if row.is_reference else BLUE,
        "is_tested": not (row.is_beyond or row.is_excluded),
    }


def _alarm_row(alarm: DriftAlarmRow, end: float, scale: float, unit: str) -> dict[str, Any]:
    sure = "" if alarm.is_sure else ", not yet sure"
    sign = "+" if alarm.drift > 0 else ""
    size = sign + supported(alarm.drift * scale, scale * (alarm.high - alarm.low) / 2, unit)
    return {
        "start": alarm.onset_start.timestamp() * 1e3,
        "end": end,
        "low": alarm.low * scale,
        "high": alarm.high * scale,
        "label": LABELS.get(alarm.rule, alarm.rule).format(size=size) + sure,
    }


def _curve_row(point: CurvePoint, axes: Axes) -> dict[str, float]:
    amplitude = 0.0 if point.amplitude is None else point.amplitude
    ends = {name: getattr(point, name) * axes.value_scale for name in ("expected", "low", "high")}
    return {"amplitude": amplitude * axes.amplitude_scale, **ends}


def _point_row(one: ObservationRow, axes: Axes) -> dict[str, float]:
    amplitude = 0.0 if one.amplitude is None else one.amplitude
    return {
        "amplitude": amplitude * axes.amplitude_scale,
        "value": one.value * axes.value_scale,
        "low": (one.value - one.std) * axes.value_scale,
        "high": (one.value + one.std) * axes.value_scale,
    }
