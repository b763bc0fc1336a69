"""Where do our numbers differ from the paper's, and why?"""

import numpy as np

from core import cms
from core.fitting_rate import fitting_rate
from service.reproduction import published
from service.reproduction.real import RealBuilding
from service.reproduction.simulated import HIGH, LOW, Simulated, scattered_total


def simulated_remarks(found: Simulated) -> tuple[str, ...]:
    """Of section 7."""
    return (_ground(found), *_forces(found), *_modes(found), *_masses(found))


def real_remarks(found: RealBuilding) -> tuple[str, ...]:
    """Of section 8."""
    return (
        f"The paper's building, Raiosya, and its record are not to be had. The same steps are shown on "
        f"{found.description.name}, direction {found.direction}, from the sensors {', '.join(found.sensors)}: the "
        "numbers are another building's and comparable in kind only.",
        "The paper cuts the record into segments of equal length; here a segment is one cycle between zero "
        "up-crossings, with an intercept, and every value has a standard deviation.",
        *(f"Not used: {reason}" for reason in found.refused),
    )


def _ground(found: Simulated) -> str:
    return (
        f"The record observed at Hiyoshi on 2005-07-23 is not to be had. {found.ground.name} stands in for it: at "
        "100 Hz, 0.1-30 Hz, at rest before and after, scaled to 70.13 gal. Another record moves every fitting rate by "
        "some points. The paper does not say how its noise is scaled; here it is white, its standard deviation the "
        "given part of each channel's RMS, on all channels."
    )


def _forces(found: Simulated) -> tuple[str, ...]:
    truth = found.response.force
    low, high = (fitting_rate(truth, found.cases[noise].forces[cms.NAME].force) for noise in (LOW, HIGH))
    quiet = fitting_rate(truth, found.quiet_base[cms.NAME].force)
    return (
        f"Figure 12: the paper loses {published.FORCE_FIT[LOW] - published.FORCE_FIT[HIGH]:.1f} points from 1 % to "
        f"10 % noise, {cms.NAME} {low - high:.1f}: the base slab's noise is multiplied by the total mass. With that "
        f"channel without noise {cms.NAME} gives {quiet:.1f} at 10 %, so that the paper may have left it so; it does "
        "not say.",
        "With as many modes as sensors the identified shapes cancel out of the force: it is F = -Σ m_i a_i over "
        "statically interpolated floors. So noise in the shapes hardly matters, and what limits the fit is the "
        "inertia of the floors without a sensor.",
    )


def _modes(found: Simulated) -> tuple[str, ...]:
    first = [_modal_fit(found, noise, 0) for noise in (LOW, HIGH)]
    second = [_modal_fit(found, noise, 1) for noise in (LOW, HIGH)]
    if None in (*first, *second):
        return ("Figures 10 and 11: under this motion not both of the first two modes are identified.",)
    return (
        f"Figures 10 and 11: at 10 % noise our modal accelerations fit worse ({first[1]:.1f} and {second[1]:.1f}) than "
        f"the paper's ({published.FIRST_MODAL_FIT[HIGH]} and {published.SECOND_MODAL_FIT[HIGH]}). The pseudo-inverse "
        "passes the noise of three channels on to them, most of it to the weaker second mode. Only "
        f"{cms.NAME} has modal coordinates.",
        "Figure 14: more modes than sensors add nothing; the third leaves the force as it was.",
    )


def _modal_fit(found: Simulated, noise: float, mode: int) -> float | None:
    modal = found.cases[noise].modal
    return None if mode >= len(modal) else fitting_rate(found.modal[mode], modal[mode])


def _masses(found: Simulated) -> tuple[str, ...]:
    low = found.cases[LOW].forces[cms.NAME].force
    slope = float(np.vdot(found.light[cms.NAME].force, low) / np.vdot(low, low))
    return (
        f"Figure 15: as the paper says, the estimate keeps its shape and is scaled, by {slope:.3f} with "
        f"{cms.NAME}. No estimator can find the total mass from these sensors.",
        f"Figure 16: the paper's draw has {scattered_total():.3f} times the total mass, so that its distribution is "
        "what remains to be seen; it matters little.",
    )
