"""An analysed event as a report: a summary for a terminal (mm, kN, kN/mm), histories as CSV, and figures."""

from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from core.analysis import DirectionAnalysis, EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription
from core.estimators.result import Assessment
from core.isolation_layer.equivalent import EquivalentSegment
from core.isolation_layer.motion import MeasuredMotion
from core.record import Finding
from core.rounding import significant, with_std
from core.tables import Table
from service.documents import charts as report_charts
from service.documents.document import Document, Part, heading, notes, paragraph

DEVIATIONS = (
    "± is one standard deviation. An error in the building's total mass scales the force, stiffness and damping of the "
    "isolators; the standard deviations do not include it."
)
SHOWN = 12
"""Cycles in a summary: the largest."""
GAL, MM, MRAD, KN, KN_PER_MM, PERCENT = 1e2, 1e3, 1e3, 1e-3, 1e-6, 1e2
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


def summary(event: EventAnalysis, description: BuildingDescription) -> Document:
    """Quality findings, then modes, peak force and equivalent values of each direction."""
    pga = "" if event.pga is None else f", largest ground acceleration {significant(event.pga * GAL)} gal"
    title = f"{description.code}, {event.start:%Y-%m-%d %H:%M:%S} UTC{pga}"
    return Document(title, tuple(_parts(event, description)))


def _parts(event: EventAnalysis, description: BuildingDescription) -> Iterator[Part]:
    if event.refusal is not None:
        yield heading(f"refused: {event.refusal}")
    if event.quality:
        yield _quality(event.quality)
    for name, result in event.directions.items():
        yield from _direction(name, result, description)
    if across := _across(event):
        yield heading(", ".join(across))
    if event.directions:
        yield notes([DEVIATIONS])


def _quality(findings: tuple[Finding, ...]) -> Table:
    headings = ("severity", "kind", "channel", "finding")
    rows = tuple((one.severity, one.kind, one.channel or "", one.message) for one in findings)
    return Table("quality", headings, rows, texts=headings)


def _direction(name: str, result: DirectionAnalysis, description: BuildingDescription) -> Iterator[Part]:
    force = result.restoring_force
    peak, std = (value * KN for value in force.peak)
    yield heading(f"direction {name}: peak force {with_std(peak, std)} kN (estimator {force.estimator})")
    if force.assessment is not None:
        yield paragraph([_assumed(force.assessment)])
    if force.modes:
        yield _modes(result, description)
    moved = [] if result.motion is None else [_moved(result.motion)]
    if result.displacement is None:
        moved.append("no displacement of the isolation layer was measured: no equivalent values")
    elif not result.equivalent:
        moved.append("no cycle was large enough for equivalent values")
    yield paragraph(moved)
    if result.displacement is not None and result.equivalent:
        yield _equivalent(result.equivalent)


def _assumed(assessment: Assessment) -> str:
    text = f"assumed: {assessment.assumption}"
    if assessment.chi_square is not None:
        text += f"; chi-square of noise alone {assessment.chi_square:.3g}"
    if not assessment.is_at_rest:
        text += "; the record does not begin and end at rest"
    return f"{text}; {100 * assessment.prior_share:.0f} % of the storeys' stiffness is prior"


def _moved(motion: MeasuredMotion) -> str:
    peak, std = motion.peak
    text = f"peak displacement {with_std(peak * MM, std * MM)} mm"
    if motion.residual is None:
        return f"{text}, integrated from accelerations: good above {motion.band[0]:.2g} Hz"
    return f"{text}, residual {with_std(motion.residual.value * MM, motion.residual.std * MM)} mm"


def _across(event: EventAnalysis) -> list[str]:
    """Results across the directions."""
    found = []
    if event.peak_resultant is not None:
        found.append(f"peak resultant displacement {significant(event.peak_resultant * MM)} mm")
    if event.torsion is not None:
        peak, std = event.torsion.peak
        found.append(f"peak torsion {with_std(peak * MRAD, std * MRAD)} mrad")
    if event.axial_load is not None:
        load = event.axial_load
        found.append(f"vertical load {load.ratio.min():.2f} to {load.ratio.max():.2f} of the weight ({load.level})")
    return found


def _modes(result: DirectionAnalysis, description: BuildingDescription) -> Table:
    rows = tuple(
        (
            str(number),
            with_std(mode.frequency, mode.frequency_std),
            with_std(mode.damping_ratio * PERCENT, _scaled(mode.damping_ratio_std, PERCENT)),
            *(f"{value:.2f}" for value in mode.shape),
        )
        for number, mode in enumerate(result.restoring_force.modes, start=1)
    )
    headings = ("mode", "Hz", "damping (%)", *(level.name for level in description.floors))
    return Table("superstructure, fixed base", headings, rows)


def _equivalent(cycles: tuple[EquivalentSegment, ...]) -> Table:
    largest = sorted(sorted(cycles, key=lambda cycle: -cycle.amplitude)[:SHOWN], key=lambda cycle: cycle.start)
    title = "isolation layer by cycle"
    if len(cycles) > SHOWN:
        title += f", the {SHOWN} largest of {len(cycles)} (--json writes all)"
    headings = ("from (s)", "to (s)", "amplitude (mm)", "strain (%)", "k_eq (kN/mm)", "c_eq (kN s/mm)")
    rows = tuple(
        (
            f"{cycle.start:.2f}",
            f"{cycle.end:.2f}",
            significant(cycle.amplitude * MM),
            "" if cycle.shear_strain is None else significant(cycle.shear_strain * PERCENT),
            with_std(cycle.k_eq * KN_PER_MM, cycle.k_eq_std * KN_PER_MM),
            with_std(cycle.c_eq * KN_PER_MM, cycle.c_eq_std * KN_PER_MM),
        )
        for cycle in largest
    )
    return Table(title, headings, rows)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def histories_csv(result: DirectionAnalysis, rate: float) -> str:
    """The histories of one direction as CSV, SI units; a column that was not measured is empty."""
    force = result.restoring_force
    motion = result.motion
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


def write_files(event: EventAnalysis, code: str, folder: Path) -> None:
    """Write every direction's `restoring_force_<direction>.csv`, `layer.csv` and figures as SVG and PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    if event.orbit is not None or event.torsion is not None or event.axial_load is not None:
        (folder / "layer.csv").write_text(layer_csv(event), encoding="utf-8")
    for name, chart in _figures_across(event).items():
        _save(chart, folder / name)
    for direction, result in event.directions.items():
        csv = folder / f"restoring_force_{direction}.csv"
        csv.write_text(histories_csv(result, event.rate), encoding="utf-8")
        for name, chart in _figures(event, code, direction, result).items():
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
    event: EventAnalysis, code: str, direction: str, result: DirectionAnalysis
) -> dict[str, report_charts.Picture]:
    force, title = result.restoring_force, f"{code}, direction {direction}"
    if result.displacement is None:
        return {}
    pictures: dict[str, report_charts.Picture] = {
        "restoring_force": report_charts.restoring_force(
            time=np.arange(force.force.size) / event.rate,
            displacement=result.displacement,
            force=force.force,
            std=force.std,
            title=f"{title}: restoring force of the isolation layer",
            subtitle=f"{event.start:%Y-%m-%d %H:%M:%S} UTC, estimator {force.estimator}",
        )
    }
    if result.equivalent:
        cycles = {event.start: result.equivalent}
        pictures["k_eq"] = report_charts.equivalent_stiffness(cycles, f"{title}: equivalent stiffness by cycle")
        pictures["c_eq"] = report_charts.equivalent_damping(cycles, f"{title}: equivalent damping by cycle")
    return pictures
