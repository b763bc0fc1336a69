"""The files of an analysed event: histories as CSV, and the figures."""

from io import StringIO
from pathlib import Path

import numpy as np

from core.analysis import DirectionAnalysis, EventAnalysis
from service import charts

COLUMNS = ("time", "displacement", "velocity", "force", "force_rigid", "force_modal", "force_std")
"""s after the start, m, m/s, N, N, N, N."""
FIGURE_SCALE = 2.0
"""Pixels of a PNG per pixel of the page, for print."""


def histories_csv(found: DirectionAnalysis, rate: float) -> str:
    """The histories of one direction as CSV, SI units; a column that was not measured is empty."""
    force = found.restoring_force
    series = (found.displacement, found.velocity, force.force, force.rigid, force.modal, force.std)
    count = force.force.size
    empty = np.full(count, "", dtype=object)
    columns = [_printed(np.arange(count) / rate), *(empty if values is None else _printed(values) for values in series)]
    out = StringIO()
    out.write(",".join(COLUMNS) + "\n")
    out.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    return out.getvalue()


def _printed(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[str]:
    """Nine digits: more than any sensor has; empty where there is no number."""
    return [f"{value:.9g}" if value == value else "" for value in values.tolist()]


def write(event: EventAnalysis, code: str, folder: Path) -> None:
    """Write every direction's `restoring_force_<direction>.csv` and figures as SVG and PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    for direction, found in event.directions.items():
        csv = folder / f"restoring_force_{direction}.csv"
        csv.write_text(histories_csv(found, event.rate), encoding="utf-8")
        for name, chart in _figures(event, code, direction, found).items():
            chart.save(str(folder / f"{name}_{direction}.svg"))
            chart.save(str(folder / f"{name}_{direction}.png"), scale_factor=FIGURE_SCALE)


def _figures(event: EventAnalysis, code: str, direction: str, found: DirectionAnalysis) -> dict[str, charts.Picture]:
    force, title = found.restoring_force, f"{code}, direction {direction}"
    if found.displacement is None:
        return {}
    pictures: dict[str, charts.Picture] = {
        "restoring_force": charts.restoring_force(
            time=np.arange(force.force.size) / event.rate,
            displacement=found.displacement,
            force=force.force,
            std=force.std,
            title=f"{title}: restoring force of the isolation layer",
            subtitle=f"{event.start:%Y-%m-%d %H:%M:%S} UTC, estimator {force.estimator}",
        )
    }
    if found.equivalent:
        cycles = {event.start: found.equivalent}
        pictures["k_eq"] = charts.equivalent_stiffness(cycles, f"{title}: equivalent stiffness by cycle")
        pictures["c_eq"] = charts.equivalent_damping(cycles, f"{title}: equivalent damping by cycle")
    return pictures
