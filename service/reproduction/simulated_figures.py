"""Figures 6 to 16: the simulated building's response, modes and restoring force."""

from collections.abc import Mapping

import numpy as np
from altair import LayerChart

from core.arrays import Vector
from core.comparison.misfit import fitting_rate
from core.estimators import cms
from core.paper import FOURTH_STOREY, PEAK, RATE
from service.documents.document import Figure
from service.reproduction import published
from service.reproduction.cells import with_noise
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
from service.reproduction.simulated import (
    LEVELS,
    LOW,
    MEASURED,
    MODES,
    ROOF,
    Forces,
    NoisyCase,
    Simulated,
    scattered_total,
)

GAL, KN, MM = 1e2, 1e-3, 1e3
ROOT_T = 1e3**-0.5
"""√kg in √t: of a coordinate of a mass-normalised mode."""
WINDOW = 20.0
"""s, length of the histories in which two curves must be distinguishable."""
SHOWN = f"The strongest {WINDOW:g} s are shown; fitting rates are for the whole record."


def response_figures(run: Simulated) -> tuple[Figure, ...]:
    """In the paper's order; without those of modes where none was identified."""
    figures = (
        _ground(run),
        _accelerations(run),
        _loop(run),
        _shapes(run),
        *_modal(run),
    )
    return tuple(one for one in figures if one.pictures)


def _ground(run: Simulated) -> Figure:
    return figure(
        6,
        "Ground acceleration",
        f"{run.ground.name}, scaled to {GAL * PEAK:.2f} gal, the peak of the record observed at Hiyoshi that the paper "
        "shows here.",
        (histories(run.time, [Curve("ground", GAL * run.ground.acceleration)], "acceleration (gal)"),),
    )


def _accelerations(run: Simulated) -> Figure:
    response = run.response
    levels = {"roof": response.floor_acceleration[ROOF], "fourth storey": response.floor_acceleration[FOURTH_STOREY]}
    levels["first floor (base slab)"] = response.base_acceleration
    panels = [
        histories(run.time, [Curve(name, GAL * samples)], "acceleration (gal)", title=f"{name}, absolute")
        for name, samples in levels.items()
    ]
    peaks = ", ".join(f"{name} {GAL * np.abs(samples).max():.1f}" for name, samples in levels.items())
    caption = f"Exact, without noise. Largest values (gal): {peaks}. The paper prints no number here."
    return figure(7, "Acceleration response of the superstructure", caption, panels)


def _loop(run: Simulated) -> Figure:
    x, force = MM * run.response.isolator_displacement, KN * run.response.force
    caption = (
        f"Exact, with the parameters of Table II: up to {np.abs(x).max():.1f} mm and {np.abs(force).max():.0f} kN. "
        "Smaller loops are steeper."
    )
    picture = loops(x, [Curve("exact", force)])
    return figure(8, "Restoring force of the isolation layer against displacement", caption, (picture,))


def _shapes(run: Simulated) -> Figure:
    analytic = run.shapes[:, :MODES] / run.shapes[ROOF, :MODES]
    panels = []
    for part, (noise, case) in zip("ab", run.cases.items(), strict=True):
        expanded = case.shapes / case.shapes[ROOF]
        for mode in range(expanded.shape[1]):
            curves = [exact(_from_base(analytic[:, mode])), Curve("expanded", _from_base(expanded[:, mode]))]
            title = f"({part}) {with_noise(noise)}, mode {mode + 1}"
            panels.append(profiles(LEVELS, curves, (MEASURED + 1).tolist(), title))
    caption = (
        "Identified at the fourth storey and the roof (dots), expanded to the other floors by eq 21, and compared with "
        "the analytic shapes. Between the sensors, the expansion neglects the inertia, which bends the second mode "
        "more than the first. Table III has the paper's numbers and ours."
    )
    return figure(9, "Expanded and analytic mode shapes", caption, panels)


def _from_base(shape: Vector) -> Vector:
    return np.concatenate([[0.0], shape])


def _modal(run: Simulated) -> tuple[Figure, ...]:
    papers = (published.FIRST_MODAL_FIT, published.SECOND_MODAL_FIT)
    ordinal = ("first", "second")
    figures = []
    for mode, paper in enumerate(papers):
        cases = {noise: case for noise, case in run.cases.items() if mode < len(case.modal)}
        if not cases:
            continue
        fits = {noise: fitting_rate(run.modal[mode], case.modal[mode]) for noise, case in cases.items()}
        said = "; at ".join(f"{with_noise(noise)}: paper {paper[noise]}, ours {fit:.1f}" for noise, fit in fits.items())
        caption = f"By eq 23. {SHOWN} Fitting rate (%) at {said}."
        panels = [_modal_panel(run, case, mode, with_noise(noise)) for noise, case in cases.items()]
        title = f"Acceleration in the {ordinal[mode]} modal coordinate"
        figures.append(figure(10 + mode, title, caption, panels))
    return tuple(figures)


def _modal_panel(run: Simulated, case: NoisyCase, mode: int, title: str) -> LayerChart:
    unit = GAL * ROOT_T
    truth = unit * run.modal[mode]
    window = strongest(truth, RATE, WINDOW)
    curves = [exact(truth[window]), Curve("estimated", unit * case.modal[mode][window])]
    return histories(run.time[window], curves, f"ξ{'₁₂'[mode]}″ (gal √t)", title=title)


FEW_CYCLES = 5.0
"""s, of a loop that shows how it is distorted."""


def force_figures(run: Simulated) -> tuple[Figure, ...]:
    """In the paper's order; without those of modes where none was identified."""
    figures = (_force(run), _loops(run), _modes(run), _light(run), _scattered(run))
    return tuple(one for one in figures if one.pictures)


def _force(run: Simulated) -> Figure:
    panels = []
    said = []
    for part, (noise, case) in zip("ab", run.cases.items(), strict=True):
        forces = _series(case.forces)
        panels.append(_overlay(run, forces, f"({part}) {with_noise(noise)}"))
        panels.append(_differences(run, forces, f"({part}) {with_noise(noise)}: estimated − exact"))
        said.append(f"{with_noise(noise)}: paper {published.FORCE_FIT[noise]}, ours {_fits(run, forces)}")
    caption = f"By eq 10. {SHOWN} Fitting rate (%) at {'; at '.join(said)}."
    return figure(12, "Estimated restoring force of the isolation layer", caption, panels)


def _loops(run: Simulated) -> Figure:
    window = strongest(run.response.force, RATE, FEW_CYCLES)
    x = MM * run.response.isolator_displacement[window]
    truth = exact(KN * run.response.force[window])
    panels = [
        loops(x, [truth, curve], title=f"{curve.name}, {with_noise(noise)}")
        for noise, case in run.cases.items()
        for curve in estimates({name: KN * force.force[window] for name, force in case.forces.items()})
    ]
    caption = (
        f"Over the exact displacement, in the strongest {FEW_CYCLES:g} s. The paper finds its estimated loop strongly "
        f"distorted. Our loop by {cms.NAME} is distorted by the inertia of the floors without a sensor and by the "
        "sensors' noise."
    )
    return figure(13, "Estimated restoring force against displacement", caption, panels)


def _modes(run: Simulated) -> Figure:
    window = strongest(run.response.force, RATE, WINDOW)
    truth = exact(KN * run.response.force[window])
    panels = [
        histories(
            run.time[window],
            [truth, Curve("estimated", KN * force[window])],
            FORCE,
            title=f"first {count} modes" if count > 1 else "first mode",
        )
        for count, force in run.by_modes.items()
    ]
    rates = {count: fitting_rate(run.response.force, force) for count, force in run.by_modes.items()}
    fits = ", ".join(f"{rate:.1f} % with {count}" for count, rate in rates.items())
    caption = (
        f"By {cms.NAME}, with {with_noise(LOW)}. {SHOWN} Fitting rate: {fits} modes. The paper finds the first two "
        "modes acceptable. With two sensors above the base slab, a third mode cannot change the force."
    )
    return figure(14, "Effect of mode selection", caption, panels)


def _light(run: Simulated) -> Figure:
    forces = _series(run.light)
    scale = published.MASS_SCALE
    corrected = {name: force / scale for name, force in forces.items()}
    caption = (
        f"All masses are assumed to be {scale:g} times the true ones, with {with_noise(LOW)}. {SHOWN} Fitting rate "
        f"(%): {_fits(run, forces)}; after division of the force by {scale:g}: {_fits(run, corrected)}. The paper says "
        "that the shape is kept and scaled by the same factor."
    )
    return figure(15, "Effect of mass estimation: all masses scaled", caption, _with_differences(run, forces))


def _scattered(run: Simulated) -> Figure:
    forces = _series(run.scattered)
    corrected = {name: force / scattered_total() for name, force in forces.items()}
    caption = (
        f"The masses are assumed to be those of the paper's draw, with {with_noise(LOW)}. {SHOWN} Fitting rate (%): "
        f"paper {published.SCATTERED_FIT}, ours {_fits(run, forces)}; with the right total mass: "
        f"{_fits(run, corrected)}."
    )
    return figure(16, "Effect of mass estimation: masses scattered by 20 %", caption, _with_differences(run, forces))


def _series(forces: Forces) -> Mapping[str, Vector]:
    """(n,) N by estimator."""
    return {name: force.force for name, force in forces.items()}


def _fits(run: Simulated, forces: Mapping[str, Vector]) -> str:
    return ", ".join(f"{name} {fitting_rate(run.response.force, force):.1f}" for name, force in forces.items())


def _overlay(run: Simulated, forces: Mapping[str, Vector], title: str) -> LayerChart:
    window = strongest(run.response.force, RATE, WINDOW)
    curves = estimates({name: KN * force[window] for name, force in forces.items()})
    return histories(run.time[window], [exact(KN * run.response.force[window]), *curves], FORCE, title=title)


def _with_differences(run: Simulated, forces: Mapping[str, Vector]) -> tuple[LayerChart, LayerChart]:
    return _overlay(run, forces, ""), _differences(run, forces, "estimated − exact")


def _differences(run: Simulated, forces: Mapping[str, Vector], title: str) -> LayerChart:
    window = strongest(run.response.force, RATE, WINDOW)
    errors = {name: KN * (force - run.response.force)[window] for name, force in forces.items()}
    return histories(run.time[window], estimates(errors), "difference (kN)", title=title, height=90)
