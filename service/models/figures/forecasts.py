"""Figures of a forecast: the isolators' displacement over time, and the floors' accelerations with their intervals."""

from typing import cast

import altair as alt

from core.forecasting.response import Quantity
from service.documents.charts import BLUE, MM, ORANGE, WIDTH, brief, curves, shown_on_hover, values
from service.documents.document import Figure, Rows, numbers
from service.models import texts
from service.models.forecast_results import ForecastOut, PeakOut

HEIGHT, STEP = 150, 22
"""Pixels: of a history, and of a level."""
LINE, BAND = "forecast", "± 2 standard deviations"


def forecast_figures(one: ForecastOut) -> list[Figure]:
    """The figures of one forecast."""
    return [displacement(one), accelerations(one)]


def drawn(figure: Figure) -> alt.VConcatChart:
    """The one picture of a figure of a forecast."""
    return cast(alt.VConcatChart, figure.pictures[0])


def displacement(one: ForecastOut, width: int = WIDTH) -> Figure:
    """Displacement of the isolators over time in every direction.

    Args:
        one: the forecast.
        width: pixels of the picture.
    """
    rows: Rows = [
        {
            "direction": history.direction,
            "time (s)": brief(time or 0.0),
            "displacement (mm)": brief(moved * MM),
            "low (mm)": brief((moved - 2 * std) * MM),
            "high (mm)": brief((moved + 2 * std) * MM),
        }
        for history in one.histories
        for time, moved, std in zip(history.time, history.displacement, history.std, strict=True)
        if moved is not None and std is not None
    ]
    panels = [_history(rows, history.direction, len(one.histories) > 1, width) for history in one.histories]
    title, caption = texts.FIGURES["forecast_displacement"]
    return Figure("displacement", title, caption, (alt.vconcat(*panels, spacing=10),), numbers(rows))


def _history(rows: Rows, direction: str, is_named: bool, width: int) -> alt.LayerChart:
    own = values([row for row in rows if row["direction"] == direction])
    colour = curves({LINE: BLUE, BAND: ORANGE})
    across = alt.X("time (s):Q", title="time after the start of the motion (s)").scale(nice=False)
    label = "displacement (mm)"
    band = (
        alt.Chart(own)
        .mark_area(opacity=0.3)
        .transform_calculate(curve=f"'{BAND}'")
        .encode(x=across, y=alt.Y("low (mm):Q", title=label), y2="high (mm):Q", color=colour)
    )
    line = (
        alt.Chart(own)
        .mark_line(strokeWidth=1.2)
        .transform_calculate(curve=f"'{LINE}'")
        .encode(
            x=across,
            y=alt.Y("displacement (mm):Q", title=label),
            color=colour,
            tooltip=shown_on_hover("time (s)", "displacement (mm)", "low (mm)", "high (mm)"),
        )
    )
    chart = alt.LayerChart(layer=[band, line], width=width, height=HEIGHT)
    return chart.properties(title=f"direction {direction}") if is_named else chart


def accelerations(one: ForecastOut, width: int = WIDTH) -> Figure:
    """Largest accelerations of the levels with their 95 % intervals, the roof at the top; arguments as above."""
    wanted: Quantity = "acceleration"
    peaks = [peak for peak in one.peaks if peak.quantity == wanted]
    directions = list(dict.fromkeys(peak.direction for peak in peaks))
    rows: Rows = [_row(peak) for peak in peaks]
    panels = [_levels(rows, direction, len(directions) > 1, width) for direction in directions]
    title, caption = texts.FIGURES["forecast_accelerations"]
    return Figure("accelerations", title, caption, (alt.vconcat(*panels, spacing=10),), numbers(rows))


def _row(peak: PeakOut) -> dict[str, object]:
    return {
        "direction": peak.direction,
        "level": peak.level,
        "acceleration (m/s²)": brief(peak.value or 0.0),
        "from (m/s²)": brief(peak.low or 0.0),
        "to (m/s²)": brief(peak.high or 0.0),
    }


def _levels(rows: Rows, direction: str, is_named: bool, width: int) -> alt.LayerChart:
    own = [row for row in rows if row["direction"] == direction]
    order = [row["level"] for row in reversed(own)]
    upwards = alt.Y("level:N", title=None, sort=order)
    label = "largest acceleration (m/s²)"
    hover = shown_on_hover("level", "acceleration (m/s²)", "from (m/s²)", "to (m/s²)")
    bars = (
        alt.Chart(values(own))
        .mark_rule(strokeWidth=2, color=ORANGE)
        .encode(x=alt.X("from (m/s²):Q", title=label), x2="to (m/s²):Q", y=upwards, tooltip=hover)
    )
    points = (
        alt.Chart(values(own))
        .mark_point(filled=True, size=45, color=BLUE, opacity=1)
        .encode(x=alt.X("acceleration (m/s²):Q", title=label), y=upwards, tooltip=hover)
    )
    chart = alt.LayerChart(layer=[bars, points], width=width, height=STEP * len(own))
    return chart.properties(title=f"direction {direction}") if is_named else chart
