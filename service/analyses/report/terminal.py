"""An analysed event for an engineer at a terminal: mm, kN, kN/mm."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from core.analysis import DirectionAnalysis, EventAnalysis
from core.description import BuildingDescription
from core.estimators.result import Assessment
from core.isolation_layer.equivalent import EquivalentSegment
from core.isolation_layer.motion import MeasuredMotion
from core.record import Finding
from core.rounding import significant, with_std

STYLES = {"note": "dim", "warning": "yellow", "fatal": "bold red"}
SHOWN = 12
"""Cycles in a summary: the largest."""
GAL, MM, MRAD, KN, KN_PER_MM, PERCENT = 1e2, 1e3, 1e3, 1e-3, 1e-6, 1e2


def summary(event: EventAnalysis, description: BuildingDescription) -> RenderableType:
    """Quality findings, then modes, peak force and equivalent values of each direction."""
    return Group(*_parts(event, description))


def _parts(event: EventAnalysis, description: BuildingDescription) -> Iterator[RenderableType]:
    pga = "" if event.pga is None else f", largest ground acceleration {significant(event.pga * GAL)} gal"
    yield Text(f"{description.code}, {event.start:%Y-%m-%d %H:%M:%S} UTC{pga}", style="bold")
    if event.refusal is not None:
        yield Text(f"refused: {event.refusal}", style=STYLES["fatal"])
    if event.quality:
        yield _quality(event.quality)
    for name, found in event.directions.items():
        yield from _direction(name, found, description)
    yield from _across(event)


def _quality(findings: tuple[Finding, ...]) -> Table:
    table = Table("severity", "kind", "channel", "finding", title="quality", title_justify="left")
    for finding in findings:
        row = (finding.severity, finding.kind, finding.channel or "", finding.message)
        table.add_row(*(Text(cell) for cell in row), style=STYLES[finding.severity])
    return table


def _direction(name: str, found: DirectionAnalysis, description: BuildingDescription) -> Iterator[RenderableType]:
    force = found.restoring_force
    peak, std = (value * KN for value in force.peak)
    yield Text(
        f"\ndirection {name}: peak force {with_std(peak, std)} kN (estimator {force.estimator})",
        style="bold",
    )
    if force.assessment is not None:
        yield Text(_assumed(force.assessment))
    if force.modes:
        yield _modes(found, description)
    if found.motion is not None:
        yield Text(_moved(found.motion))
    if found.displacement is None:
        yield Text("no displacement of the isolation layer was measured: no equivalent values")
    elif not found.equivalent:
        yield Text("no cycle was large enough for equivalent values")
    else:
        yield _equivalent(found.equivalent)


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


def _across(event: EventAnalysis) -> Iterator[RenderableType]:
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
    if found:
        yield Text("\n" + ", ".join(found), style="bold")


def _modes(found: DirectionAnalysis, description: BuildingDescription) -> Table:
    floors = [level.name for level in description.floors]
    table = Table("mode", "Hz", "damping (%)", title="superstructure, fixed base", title_justify="left")
    for floor in floors:
        table.add_column(Text(floor), justify="right")
    for number, mode in enumerate(found.restoring_force.modes, start=1):
        shape = (f"{value:.2f}" for value in mode.shape)
        damping = with_std(mode.damping_ratio * PERCENT, _scaled(mode.damping_ratio_std, PERCENT))
        table.add_row(str(number), with_std(mode.frequency, mode.frequency_std), damping, *shape)
    return table


def _equivalent(cycles: tuple[EquivalentSegment, ...]) -> Table:
    largest = sorted(sorted(cycles, key=lambda cycle: -cycle.amplitude)[:SHOWN], key=lambda cycle: cycle.start)
    title = "isolation layer by cycle"
    if len(cycles) > SHOWN:
        title += f", the {SHOWN} largest of {len(cycles)} (--json writes all)"
    table = Table(title=title, title_justify="left")
    for heading in ("from (s)", "to (s)", "amplitude (mm)", "strain (%)", "k_eq (kN/mm)", "c_eq (kN s/mm)"):
        table.add_column(heading, justify="right", no_wrap=heading.startswith(("k_eq", "c_eq")))
    for cycle in largest:
        table.add_row(
            f"{cycle.start:.2f}",
            f"{cycle.end:.2f}",
            significant(cycle.amplitude * MM),
            "" if cycle.shear_strain is None else significant(cycle.shear_strain * PERCENT),
            with_std(cycle.k_eq * KN_PER_MM, cycle.k_eq_std * KN_PER_MM),
            with_std(cycle.c_eq * KN_PER_MM, cycle.c_eq_std * KN_PER_MM),
        )
    return table


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor
