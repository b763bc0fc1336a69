"""The files of an analysed event: histories as CSV, and the figures."""

from collections.abc import Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from core.analysis import DirectionAnalysis, EventAnalysis
from core.arrays import Vector
from service.reports import charts as report_charts

COLUMNS = (
    "time",
    "displacement",
    "displacement_std",
    "velocity",
    "velocity_std",
    "force",
    "force_rigid",
    "force_modal",
    "force_std",
)
"""s after the start, m, m, m/s, m/s, N, N, N, N."""
LAYER_COLUMNS = ("time", "displacement_x", "displacement_y", "torsion", "torsion_std", "axial_load")
"""s after the start, m, m, rad, rad, vertical force over weight."""
FIGURE_SCALE = 2.0
"""Pixels of a PNG per pixel of the page, for print."""


def histories_csv(found: DirectionAnalysis, rate: float) -> str:
    """The histories of one direction as CSV, SI units; a column that was not measured is empty."""
    force = found.restoring_force
    motion = found.motion
    moved: Sequence[Vector | None] = (
        [None] * 4
        if motion is None
        else [motion.displacement, motion.displacement_std, motion.velocity, motion.velocity_std]
    )
    return _csv(COLUMNS, [*moved, force.force, force.rigid, force.modal, force.std], force.force.size, rate)


def layer_csv(event: EventAnalysis) -> str:
    """The histories across directions as CSV, SI units; a column that is not known is empty."""
    x, y = (None, None) if event.orbit is None else event.orbit
    turned = (None, None) if event.torsion is None else (event.torsion.displacement, event.torsion.displacement_std)
    load = None if event.axial_load is None else event.axial_load.ratio
    return _csv(LAYER_COLUMNS, (x, y, *turned, load), event.count, event.rate)


def _csv(names: Sequence[str], series: Sequence[Vector | None], count: int, rate: float) -> str:
    empty = [""] * count
    columns = [_printed(np.arange(count) / rate), *(empty if values is None else _printed(values) for values in series)]
    out = StringIO()
    out.write(",".join(names) + "\n")
    out.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    return out.getvalue()


def _printed(values: Vector) -> list[str]:
    """Nine digits: more than any sensor has; empty where there is no number."""
    return [f"{value:.9g}" if value == value else "" for value in values.tolist()]


def write(event: EventAnalysis, code: str, folder: Path) -> None:
    """Write every direction's `restoring_force_<direction>.csv`, `layer.csv` and figures as SVG and PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    if event.orbit is not None or event.torsion is not None or event.axial_load is not None:
        (folder / "layer.csv").write_text(layer_csv(event), encoding="utf-8")
    for name, chart in _figures_across(event).items():
        _save(chart, folder / name)
    for direction, found in event.directions.items():
        csv = folder / f"restoring_force_{direction}.csv"
        csv.write_text(histories_csv(found, event.rate), encoding="utf-8")
        for name, chart in _figures(event, code, direction, found).items():
            _save(chart, folder / f"{name}_{direction}")


def _save(chart: report_charts.Picture, path: Path) -> None:
    chart.save(f"{path}.svg")
    chart.save(f"{path}.png", scale_factor=FIGURE_SCALE)


def _figures_across(event: EventAnalysis) -> dict[str, report_charts.Picture]:
    time = np.arange(event.count) / event.rate
    pictures: dict[str, report_charts.Picture] = {}
    if event.orbit is not None:
        pictures["orbit"] = report_charts.orbit(time, *event.orbit)
    if event.torsion is not None:
        pictures["torsion"] = report_charts.torsion_history(
            time, event.torsion.displacement, event.torsion.displacement_std
        )
    if event.axial_load is not None:
        pictures["axial_load"] = report_charts.axial_load_history(time, event.axial_load.ratio)
    return pictures


def _figures(
    event: EventAnalysis, code: str, direction: str, found: DirectionAnalysis
) -> dict[str, report_charts.Picture]:
    force, title = found.restoring_force, f"{code}, direction {direction}"
    if found.displacement is None:
        return {}
    pictures: dict[str, report_charts.Picture] = {
        "restoring_force": report_charts.restoring_force(
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
        pictures["k_eq"] = report_charts.equivalent_stiffness(cycles, f"{title}: equivalent stiffness by cycle")
        pictures["c_eq"] = report_charts.equivalent_damping(cycles, f"{title}: equivalent damping by cycle")
    return pictures
