"""Differences between our numbers and the paper's, with their causes."""

from collections.abc import Iterator

import numpy as np

from core.arrays import Vector
from core.comparison.misfit import fitting_rate
from core.estimators import cms
from service.reproduction import published
from service.reproduction.real import RealBuilding
from service.reproduction.simulated import HIGH, LOW, Simulated, scattered_total
from service.reproduction.table import with_noise

IDENTIFICATION = (
    "Table III: the paper identifies the modes by N4SID of a Matlab toolbox. Here subspaces are weighted by canonical "
    "variate analysis, poles are chosen by their stability over the orders, and the noise of the input is allowed for."
)
LEFT_OUT = "Figures {} are left out: {}."


def simulated_remarks(found: Simulated) -> tuple[str, ...]:
    """Remarks on section 7."""
    return (_ground(found), IDENTIFICATION, *_forces(found), *_modes(found), *_masses(found))


def real_remarks(found: RealBuilding) -> tuple[str, ...]:
    """Remarks on section 8."""
    return (
        "The paper's building is Raiosya, whose records do not come with this program. Here the same steps are applied "
        f"to {found.description.name}, direction {found.direction}, from the sensors {', '.join(found.sensors)}: the "
        "numbers are another building's and comparable in kind only.",
        "The paper cuts the record into segments and does not say which; here a segment is one cycle between zero "
        "up-crossings, with an intercept, and every value has a standard deviation.",
        *_missing(found),
        *(f"Not used: {reason}" for reason in found.refused),
    )


def _missing(found: RealBuilding) -> Iterator[str]:
    shown = found.strongest.by_estimator[cms.NAME]
    if shown.displacement is None:
        yield LEFT_OUT.format("19, 23 and 24", "no sensor measures the layer's motion")
    if not shown.restoring_force.modes:
        yield LEFT_OUT.format("20 and 21", "no mode was identified")


def _ground(found: Simulated) -> str:
    return (
        "The record observed at Hiyoshi on 2005-07-23 does not come with this program. It is replaced by "
        f"{found.ground.name}: at 100 Hz, 0.1-30 Hz, at rest before and after, scaled to 70.13 gal. Another record "
        "moves every fitting rate by some points. The paper does not say how its noise is scaled; here it is white, "
        "its standard deviation the given part of each channel's RMS, on all channels, one draw "
        f"(seed {found.seed})."
    )


def _forces(found: Simulated) -> tuple[str, ...]:
    papers = published.FORCE_FIT
    truth = found.response.force
    low, high = (fitting_rate(truth, found.cases[noise].forces[cms.NAME].force) for noise in (LOW, HIGH))
    quiet = fitting_rate(truth, found.quiet_base[cms.NAME].force)
    return (
        f"Figure 12: errors add in squares, so that {with_noise(HIGH)} adds {_added(papers[LOW], papers[HIGH]):.1f} % "
        f"of the force's norm in the paper ({papers[LOW]} to {papers[HIGH]}), {_added(low, high):.1f} % by {cms.NAME} "
        f"({low:.1f} to {high:.1f}), and {_added(low, quiet):.1f} % with noise above the base slab only. The paper's "
        "fit is therefore not reproduced; it does not say how its noise was made, or filtered.",
        "With as many modes as sensors the identified shapes cancel out of the force: it is F = -Σ m_i a_i over "
        "statically interpolated floors. So noise in the shapes has little effect, and the fit without noise is "
        "limited by the inertia of the floors without a sensor.",
    )


def _added(low: float, high: float) -> float:
    """%, contribution of noise to an error, from the fitting rates with little and with more noise."""
    return float(np.sqrt(max(0.0, (100 - high) ** 2 - (100 - low) ** 2)))


def _modes(found: Simulated) -> tuple[str, ...]:
    fits = [[_modal_fit(found, noise, mode) for noise in (LOW, HIGH)] for mode in range(2)]
    losses = [low - high for low, high in fits if low is not None and high is not None]
    if len(losses) < len(fits):
        return ("Figures 9 to 11 and 14 lack modes: under this motion not both of the first two are identified.",)
    papers = [paper[LOW] - paper[HIGH] for paper in (published.FIRST_MODAL_FIT, published.SECOND_MODAL_FIT)]
    return (
        f"Figures 10 and 11: from {with_noise(LOW)} to {with_noise(HIGH)} the modal accelerations lose "
        f"{losses[0]:.1f} and {losses[1]:.1f} points, in the paper {papers[0]:.1f} and {papers[1]:.1f}. The "
        "pseudo-inverse passes the noise of all channels on to them, and the second mode is the weaker one. Only "
        f"{cms.NAME} has modal coordinates.",
        "Figure 14: with two sensors above the base slab the third mode leaves the force as it was.",
    )


def _modal_fit(found: Simulated, noise: float, mode: int) -> float | None:
    modal = found.cases[noise].modal
    return None if mode >= len(modal) else fitting_rate(found.modal[mode], modal[mode])


def _masses(found: Simulated) -> tuple[str, ...]:
    truth, right = found.response.force, found.cases[LOW].forces
    slopes = (f"{name} {_slope(right[name].force, light.force):.3f}" for name, light in found.light.items())
    losses = (
        f"{name} {fitting_rate(truth, right[name].force) - fitting_rate(truth, drawn.force):.1f}"
        for name, drawn in found.scattered.items()
    )
    papers = published.FORCE_FIT[LOW] - published.SCATTERED_FIT
    return (
        f"Figure 15: as the paper says, the estimate keeps its shape and is scaled, by {published.MASS_SCALE:g} in the "
        f"paper and here ({', '.join(slopes)}). No estimator can find the total mass from these sensors.",
        f"Figure 16: the paper's draw has {scattered_total():.3f} times our building's total mass, so that little but "
        f"the distribution is wrong; that costs ({', '.join(losses)}) points, and {papers:.1f} in the paper.",
    )


def _slope(right: Vector, light: Vector) -> float:
    """Slope of the regression of one force on the other."""
    return float(np.vdot(right, light) / np.vdot(right, right))
