"""Strength that grows with the speed, as that of lead: Robinson (1982) found a power of the shear rate.

Below a speed the strength is constant: no measured strength vanishes at rest. All strengths are those at USUAL.
"""

from core.effect import Effect, LogNormal, Parameter

USUAL = 0.1
"""m/s, speed at which the strength is that of the model without the effect. A choice."""


def law(v, power, slow):
    ratio, usual = v / slow, USUAL / slow
    return ((1.0 + ratio * ratio) / (1.0 + usual * usual)) ** (0.5 * power)


EFFECT = Effect(
    title="Strength that grows with speed",
    law=law,
    acts_on="strength",
    parameters=(
        Parameter("power", "1", (0.0, 1.0), LogNormal(0.05, 1.0), "power of the speed in fast motion"),
        Parameter("slow", "m/s", (1e-4, 1.0), LogNormal(0.01, 1.2), "speed below which the strength is constant"),
    ),
    absent={"power": 0.0},
    family="nonlinear viscosity",
    explanation="The strength of the hysteresis grows with the speed to the power {power:.2f} from {slow} on.",
    suspect_when="Fast loops are higher than slow ones of the same amplitude, and highest in the middle, where they "
    "are fastest; their height grows much less than the speed.",
    source="Robinson (1982): shear stress of lead as a power of the shear rate, 0.035 in fast and 0.15 in slow motion",
)
