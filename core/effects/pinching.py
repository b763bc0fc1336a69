"""Slip of the hysteresis near zero force: Baber & Noori (1986), in the form of Foliente (1995)."""

from math import copysign, exp

from core.effect import Effect, LogNormal, Normal, Parameter


def law(v, yielded, z1, z2, q):
    beyond = (yielded * copysign(1.0, v) - q) / z2
    return 1.0 - z1 * exp(-beyond * beyond)


EFFECT = Effect(
    title="Pinching of the yield",
    law=law,
    acts_on="flow",
    parameters=(
        Parameter("z1", "1", (0.0, 0.98), LogNormal(0.5, 0.7), "largest share of the slope that is lost"),
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
    ),
    absent={"z1": 0.0},
    family="shape of the yield",
    explanation="Near {q:.2f} of the yield force the damper slips: within {z2:.2f} of the yield force, its slope is "
    "reduced by a share of up to {z1:.2f}.",
    suspect_when="The loops are narrow near zero force, or the force rises late after a reversal.",
    source="Baber & Noori (1986); Foliente (1995): pinching by a bell curve of the hysteretic variable",
)
