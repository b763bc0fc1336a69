"""Figures 18 to 24: the same steps on the user's building."""

import numpy as np
from altair import LayerChart

from core.comparison.misfit import fitting_rate
from core.estimators import cms
from service.documents import charts as report_charts
from service.documents.document import Figure
from service.reproduction.drawing import (
    FORCE,
    Curve,
    estimates,
    exact,
    figure,
    histories,
    loops,
    profiles,
    strongest,
)
from service.reproduction.real import RealBuilding, RealEvent
from service.reproduction.simulated import MODES
from service.reproduction.simulated_figures import GAL, KN, MM, ROOT_T, WINDOW


def real_figures(building: RealBuilding) -> tuple[Figure, ...]:
    """In the paper's order, histories of the strongest event; what needs a displacement only where there is one."""
    event = building.strongest
    figures = [
        _accelerations(building, event),
        _deformation(building, event),
        _shapes(building, event),
        _modal(building, event),
    ]
    figures += [_force(building, event), _loop(building, event), _equivalents(building)]
    return tuple(one for one in figures if one is not None)


def _of(building: RealBuilding, event: RealEvent) -> str:
    return f"{building.description.name}, {event.start:%Y-%m-%d %H:%M} UTC, direction {building.direction}"


def _accelerations(building: RealBuilding, event: RealEvent) -> Figure:
    structure = event.superstructure
    rows = [structure.base_acceleration, *structure.floor_acceleration]
    names = [building.description.base.name, *(building.description.floors[i].name for i in structure.measured)]
    panels = [
        histories(event.time, [Curve(name, GAL * samples)], "acceleration (gal)", title=f"level {name}")
        for name, samples in zip(names[::-1], rows[::-1], strict=True)
    ]
    return figure(18, "Acceleration response", f"{_of(building, event)}. Absolute acceleration.", panels)


def _deformation(building: RealBuilding, event: RealEvent) -> Figure | None:
    displacement = event.by_estimator[cms.NAME].displacement
    if displacement is None:
        return None
    caption = f"{_of(building, event)}. Up to {MM * np.abs(displacement).max():.1f} mm."
    picture = histories(event.time, [Curve("layer", MM * displacement)], "deformation (mm)")
    return figure(19, "Deformation of the isolation layer", caption, (picture,))


def _shapes(building: RealBuilding, event: RealEvent) -> Figure | None:
    levels = [building.description.base.name, *(level.name for level in building.description.floors)]
    measured = (event.superstructure.measured + 1).tolist()
    panels = [
        profiles(levels, [Curve("expanded", np.append(0.0, mode.shape))], measured, f"mode {number}")
        for number, mode in enumerate(event.by_estimator[cms.NAME].restoring_force.modes[:MODES], start=1)
    ]
    caption = f"{_of(building, event)}. Identified at the dots, expanded by eq 21 elsewhere. Table IV has the numbers."
    return figure(20, "Expanded mode shapes", caption, panels) if panels else None


def _modal(building: RealBuilding, event: RealEvent) -> Figure | None:
    unit = GAL * ROOT_T
    panels = [
        histories(event.time, [Curve("ξ", unit * series)], f"ξ{'₁₂'[number]}″ (gal √t)", title=f"mode {number + 1}")
        for number, series in enumerate(event.modal)
    ]
    caption = f"{_of(building, event)}. By eq 23, with mass-normalised shapes."
    return figure(21, "Acceleration in modal coordinates", caption, panels) if panels else None


def _force(building: RealBuilding, event: RealEvent) -> Figure:
    forces = {name: KN * analysis.restoring_force.force for name, analysis in event.by_estimator.items()}
    whole = histories(event.time, estimates(forces), FORCE, title="whole record")
    window = strongest(event.by_estimator[cms.NAME].restoring_force.force, event.rate, WINDOW)
    curves = estimates({name: force[window] for name, force in forces.items()})
    known = [] if event.truth is None else [exact(KN * event.truth[window])]
    panels = [whole, histories(event.time[window], [*known, *curves], FORCE, title=f"the strongest {WINDOW:g} s")]
    caption = f"{_of(building, event)}. By eq 10."
    if event.truth is not None:
        truth = KN * event.truth
        fits = ", ".join(f"{name} {fitting_rate(truth, force):.1f} %" for name, force in forces.items())
        errors = estimates({name: (force - truth)[window] for name, force in forces.items()})
        panels.append(histories(event.time[window], errors, "difference (kN)", title="estimated − exact", height=90))
        caption += f" Exact is F = −Σ m_i a_i over all levels, of which the estimators used some. Fitting rate: {fits}."
    return figure(22, "Restoring force of the isolation layer", caption, panels)


def _loop(building: RealBuilding, event: RealEvent) -> Figure | None:
    displacement = event.by_estimator[cms.NAME].displacement
    if displacement is None:
        return None
    forces = {name: KN * analysis.restoring_force.force for name, analysis in event.by_estimator.items()}
    panels = [loops(MM * displacement, [curve], title=curve.name) for curve in estimates(forces)]
    caption = f"{_of(building, event)}. The paper finds strong hysteresis."
    return figure(23, "Force against displacement", caption, panels)


def _equivalents(building: RealBuilding) -> Figure | None:
    panels: list[LayerChart] = []
    for name in building.strongest.by_estimator:
        analyses = {event.start: event.by_estimator.get(name) for event in building.events}
        cycles = {start: analysis.equivalent for start, analysis in analyses.items() if analysis is not None}
        if any(cycles.values()):
            panels.append(report_charts.equivalent_stiffness(cycles, f"equivalent stiffness, {name}"))
            panels.append(report_charts.equivalent_damping(cycles, f"equivalent damping, {name}"))
    caption = (
        f"{building.description.name}, direction {building.direction}: every cycle of every event, with bars of ± 1 "
        "standard deviation. The paper finds that both fall with amplitude and that stiffness is the more stable of "
        "the two. The table above says how far that is so here."
    )
    title = "Equivalent stiffness and damping coefficient"
    return figure(24, title, caption, panels) if panels else None
