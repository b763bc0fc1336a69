"""Figures 6 to 11: ground motion, response, mode shapes and modal accelerations of the simulated building."""

import numpy as np
from altair import LayerChart

from core.arrays import Vector
from core.comparison.fitting_rate import fitting_rate
from core.paper import FOURTH_STOREY, PEAK, RATE
from service.reproduction import published
from service.reproduction.drawing import Curve, Figure, exact, histories, loops, profiles, strongest
from service.reproduction.modal import MODES
from service.reproduction.simulated import LEVELS, MEASURED, ROOF, NoisyCase, Simulated
from service.reproduction.table import with_noise

GAL, KN, MM = 1e2, 1e-3, 1e3
ROOT_T = 1e3**-0.5
"""√kg in √t: of a coordinate of a mass-normalised mode."""
WINDOW = 20.0
"""s, of the histories in which two curves are to be told apart."""
SHOWN = f"the strongest {WINDOW:g} s; the fitting rate is of the whole record"


def response_figures(found: Simulated) -> tuple[Figure, ...]:
    """In the paper's order; without those of modes where none was identified."""
    figures = (_ground(found), _accelerations(found), _loop(found), _shapes(found), *_modal(found))
    return tuple(figure for figure in figures if figure.panels)


def _ground(found: Simulated) -> Figure:
    return Figure(
        6,
        "Ground acceleration",
        f"{found.ground.name}, scaled to the {GAL * PEAK:.2f} gal of the record observed at Hiyoshi, which the paper "
        "shows here.",
        (histories(found.time, [Curve("ground", GAL * found.ground.acceleration)], "acceleration (gal)"),),
    )


def _accelerations(found: Simulated) -> Figure:
    response = found.response
    levels = {"roof": response.floor_acceleration[ROOF], "fourth storey": response.floor_acceleration[FOURTH_STOREY]}
    levels["first floor (base slab)"] = response.base_acceleration
    panels = [
        histories(found.time, [Curve(name, GAL * samples)], "acceleration (gal)", title=f"{name}, absolute")
        for name, samples in levels.items()
    ]
    peaks = ", ".join(f"{name} {GAL * np.abs(samples).max():.1f}" for name, samples in levels.items())
    caption = f"Exact, without noise. Largest values (gal): {peaks}. The paper prints no number of its own here."
    return Figure(7, "Acceleration response of the superstructure", caption, tuple(panels))


def _loop(found: Simulated) -> Figure:
    x, force = MM * found.response.isolator_displacement, KN * found.response.force
    caption = (
        f"Exact: up to {np.abs(x).max():.1f} mm and {np.abs(force).max():.0f} kN, with Table II's parameters. "
        "The smaller a loop, the steeper it is."
    )
    picture = loops(x, [Curve("exact", force)])
    return Figure(8, "Restoring force of the isolation layer against displacement", caption, (picture,))


def _shapes(found: Simulated) -> Figure:
    analytic = found.shapes[:, :MODES] / found.shapes[ROOF, :MODES]
    panels = []
    for part, (noise, case) in zip("ab", found.cases.items(), strict=True):
        expanded = case.shapes / case.shapes[ROOF]
        for mode in range(expanded.shape[1]):
            curves = [exact(_from_base(analytic[:, mode])), Curve("expanded", _from_base(expanded[:, mode]))]
            title = f"({part}) {with_noise(noise)}, mode {mode + 1}"
            panels.append(profiles(LEVELS, curves, (MEASURED + 1).tolist(), title))
    caption = (
        "Identified at the fourth storey and the roof (dots) and expanded to the other floors by eq 21, against the "
        "analytic shapes. Between the sensors the expansion leaves out the inertia, which bends the second mode more "
        "than the first. Table III has the paper's numbers and ours."
    )
    return Figure(9, "Expanded and analytic mode shapes", caption, tuple(panels))


def _from_base(shape: Vector) -> Vector:
    return np.concatenate([[0.0], shape])


def _modal(found: Simulated) -> tuple[Figure, ...]:
    papers = (published.FIRST_MODAL_FIT, published.SECOND_MODAL_FIT)
    ordinal = ("first", "second")
    figures = []
    for mode, paper in enumerate(papers):
        cases = {noise: case for noise, case in found.cases.items() if mode < len(case.modal)}
        if not cases:
            continue
        fits = {noise: fitting_rate(found.modal[mode], case.modal[mode]) for noise, case in cases.items()}
        said = "; ".join(f"{with_noise(noise)}: paper {paper[noise]}, ours {fit:.1f}" for noise, fit in fits.items())
        caption = f"Eq 23; {SHOWN}. Fitting rate (%) at {said}."
        panels = [_modal_panel(found, case, mode, with_noise(noise)) for noise, case in cases.items()]
        title = f"Acceleration in the {ordinal[mode]} modal coordinate"
        figures.append(Figure(10 + mode, title, caption, tuple(panels)))
    return tuple(figures)


def _modal_panel(found: Simulated, case: NoisyCase, mode: int, title: str) -> LayerChart:
    unit = GAL * ROOT_T
    truth = unit * found.modal[mode]
    window = strongest(truth, RATE, WINDOW)
    curves = [exact(truth[window]), Curve("estimated", unit * case.modal[mode][window])]
    return histories(found.time[window], curves, f"ξ{'₁₂'[mode]}″ (gal √t)", title=title)
