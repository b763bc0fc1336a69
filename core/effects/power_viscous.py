"""Damper whose force is a power of its speed: Soong & Constantinou (1994).

In another form it is linear at low speed, as fluids of Eyring (1936) and Carreau (1972) are.
"""

from core.effect import Effect, LogNormal, Normal, Parameter

LINEAR_BELOW = 1e-3
"""Usual share of the reference speed below which the force is linear. A choice: no damper's force has an infinite
slope, and no solver could follow it."""


def law(v, force, exponent, speed, linear):
    ratio = v / speed
    return force * ratio * ((ratio * ratio + linear * linear) / (1.0 + linear * linear)) ** (0.5 * exponent - 0.5)


EFFECT = Effect(
    title="Power-law viscous damper",
    law=law,
    linear=("force",),
    forms={"linear": (0.01, 0.03, 0.1, 0.3)},
    held=("speed",),  # a reference value: force and exponent describe the damper
    parameters=(
        Parameter("force", "N", (0.0, 1e11), LogNormal(1e6, 1.5), "force at the reference speed"),
        Parameter("exponent", "1", (0.05, 4.0), LogNormal(0.5, 0.7), "power of the speed"),
        Parameter("speed", "m/s", (1e-3, 10.0), LogNormal(0.1, 1.0), "reference speed"),
        Parameter(
            "linear",
            "1",
            (1e-6, 2.0),
            Normal(LINEAR_BELOW, 0.1),
            "share of that speed below which the force is linear",
        ),
    ),
    absent={"force": 0.0},
    family="nonlinear viscosity",
    explanation="A damper resists with {force} at {speed}; its force grows with the speed to the power {exponent:.2f}.",
    suspect_when="The damping ratio that a linear dashpot would need changes with the amplitude of the velocity.",
    source="Soong & Constantinou (1994): fluid viscous dampers, force C |v|^α sgn v; Carreau (1972), eq 1",
)
