"""Slip of the hysteresis near zero force that grows with the energy it has dissipated: Baber & Noori (1986).

The bell curve of Foliente (1995), with their severity ζ₁ = z1 (1 - exp(-p ε)). ε, in m, is the work of the damper's
force over F_y, and `wear` is 1 / p.
"""

from math import copysign, exp

from core.effect import Effect, LogNormal, Normal, Parameter


def law(v, yielded, energy, z1, z2, q, wear):
    beyond = (yielded * copysign(1.0, v) - q) / z2
    severity = z1 * (1.0 - exp(-max(energy, 0.0) / wear))
    return 1.0 - severity * exp(-beyond * beyond), yielded * v


EFFECT = Effect(
    title="Pinching that grows with use",
    law=law,
    states=("energy",),
    carried=("energy",),
    acts_on="flow",
    special={"wear": 0.0},
    parameters=(
        Parameter("z1", "1", (0.0, 0.98), LogNormal(0.7, 0.5), "share of the slope that is lost in the end"),
        Parameter(
            "z2", "1", (0.02, 1.0), LogNormal(0.2, 0.7), "width of the pinched part, as a share of the yield force"
        ),
        Parameter(
            "q",
            "1",
            (-0.5, 0.8),
            Normal(0.15, 0.15),
            "its position as a share of the yield force, positive along the motion",
        ),
        Parameter("wear", "m", (1e-3, 1e3), LogNormal(1.0, 1.5), "work over yield force after which 1/e is to come"),
    ),
    absent={"z1": 0.0},
    family="shape of the yield",
    explanation="With use the damper begins to slip near {q:.2f} of the yield force: within {z2:.2f} of the yield "
    "force, its slope is in the end reduced by a share of up to {z1:.2f}, most of it within {wear} of fully yielded "
    "travel.",
    suspect_when="The loops become narrower near zero force as the motion goes on, and stay so in later earthquakes.",
    source="Baber & Noori (1986): severity of pinching by dissipated energy; Foliente (1995)",
)
