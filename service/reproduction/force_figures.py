"""Figures 12 to 16: the simulated building's restoring force, and what modes and masses do to it."""

from collections.abc import Mapping

from altair import LayerChart

from core.arrays import Vector
from core.comparison.fitting_rate import fitting_rate
from core.estimators import cms
from core.paper import RATE
from service.reproduction import published
from service.reproduction.drawing import FORCE, Curve, Figure, estimates, exact, histories, loops, strongest
from service.reproduction.simulated import LOW, Forces, Simulated, scattered_total
from service.reproduction.simulated_figures import KN, MM, SHOWN, WINDOW
from service.reproduction.table import with_noise

FEW_CYCLES = 5.0
"""s, of a loop that shows how it is distorted."""


def force_figures(found: Simulated) -> tuple[Figure, ...]:
    """In the paper's order; without those of modes where none was identified."""
    figures = (_force(found), _loops(found), _modes(found), _light(found), _scattered(found))
    return tuple(figure for figure in figures if figure.panels)


def _force(found: Simulated) -> Figure:
    panels = []
    said = []
    for part, (noise, case) in zip("ab", found.cases.items(), strict=True):
        forces = _series(case.forces)
        panels.append(_overlay(found, forces, f"({part}) {with_noise(noise)}"))
        panels.append(_differences(found, forces, f"({part}) {with_noise(noise)}: estimated − exact"))
        said.append(f"{with_noise(noise)}: paper {published.FORCE_FIT[noise]}, ours {_fits(found, forces)}")
    caption = f"Eq 10; {SHOWN}. Fitting rate (%) at {'; '.join(said)}."
    return Figure(12, "Estimated restoring force of the isolation layer", caption, tuple(panels))


def _loops(found: Simulated) -> Figure:
    window = strongest(found.response.force, RATE, FEW_CYCLES)
    x = MM * found.response.isolator_displacement[window]
    truth = exact(KN * found.response.force[window])
    panels = [
        loops(x, [truth, curve], title=f"{curve.name}, {with_noise(noise)}")
        for noise, case in found.cases.items()
        for curve in estimates({name: KN * force.force[window] for name, force in case.forces.items()})
    ]
    caption = (
        f"Over the exact displacement, the strongest {FEW_CYCLES:g} s. The paper finds its estimated loop distorted a "
        f"lot. What distorts ours by {cms.NAME} is the inertia of the floors without a sensor, and the sensors' noise "
        "on top of it."
    )
    return Figure(13, "Estimated restoring force against displacement", caption, tuple(panels))


def _modes(found: Simulated) -> Figure:
    window = strongest(found.response.force, RATE, WINDOW)
    truth = exact(KN * found.response.force[window])
    panels = [
        histories(
            found.time[window],
            [truth, Curve("estimated", KN * force[window])],
            FORCE,
            title=f"first {count} modes" if count > 1 else "first mode",
        )
        for count, force in found.by_modes.items()
    ]
    rates = {count: fitting_rate(found.response.force, force) for count, force in found.by_modes.items()}
    fits = ", ".join(f"{rate:.1f} % with {count}" for count, rate in rates.items())
    caption = (
        f"By {cms.NAME}, {with_noise(LOW)}; {SHOWN}: {fits} modes. The paper finds the first "
        "two acceptable; with two sensors above the base slab a third cannot change the force."
    )
    return Figure(14, "Effect of mode selection", caption, tuple(panels))


def _light(found: Simulated) -> Figure:
    forces = _series(found.light)
    scale = published.MASS_SCALE
    corrected = {name: force / scale for name, force in forces.items()}
    caption = (
        f"All masses taken for {scale:g} times theirs, {with_noise(LOW)}; {SHOWN}: {_fits(found, forces)}, and "
        f"{_fits(found, corrected)} once divided by {scale:g}. The paper says that the "
        "shape is kept and scaled by the same degree."
    )
    return Figure(15, "Effect of mass estimation: all masses scaled", caption, _with_differences(found, forces))


def _scattered(found: Simulated) -> Figure:
    forces = _series(found.scattered)
    corrected = {name: force / scattered_total() for name, force in forces.items()}
    caption = (
        f"The masses taken for the paper's draw, {with_noise(LOW)}; {SHOWN}: paper {published.SCATTERED_FIT}, ours "
        f"{_fits(found, forces)}, and {_fits(found, corrected)} with the right total mass."
    )
    return Figure(16, "Effect of mass estimation: masses scattered by 20 %", caption, _with_differences(found, forces))


def _series(forces: Forces) -> Mapping[str, Vector]:
    """(n,) N by estimator."""
    return {name: force.force for name, force in forces.items()}


def _fits(found: Simulated, forces: Mapping[str, Vector]) -> str:
    return ", ".join(f"{name} {fitting_rate(found.response.force, force):.1f}" for name, force in forces.items())


def _overlay(found: Simulated, forces: Mapping[str, Vector], title: str) -> LayerChart:
    window = strongest(found.response.force, RATE, WINDOW)
    curves = estimates({name: KN * force[window] for name, force in forces.items()})
    return histories(found.time[window], [exact(KN * found.response.force[window]), *curves], FORCE, title=title)


def _with_differences(found: Simulated, forces: Mapping[str, Vector]) -> tuple[LayerChart, LayerChart]:
    return _overlay(found, forces, ""), _differences(found, forces, "estimated − exact")


def _differences(found: Simulated, forces: Mapping[str, Vector], title: str) -> LayerChart:
    window = strongest(found.response.force, RATE, WINDOW)
    errors = {name: KN * (force - found.response.force)[window] for name, force in forces.items()}
    return histories(found.time[window], estimates(errors), "difference (kN)", title=title, height=90)
