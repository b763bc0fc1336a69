"""Damper whose force grows with the logarithm of its speed: Eyring (1936).

Polymers and lubricated contacts behave so over several decades of speed.
"""

from math import asinh, log

from core.effect import Effect, LogNormal, Parameter

LOG_10 = log(10.0)


def law(v, increase, speed):
    return increase * asinh(v / speed) / LOG_10


EFFECT = Effect(
    title="Logarithmic viscous damper",
    law=law,
    linear=("increase",),
    parameters=(
        Parameter("increase", "N", (0.0, 1e10), LogNormal(1e6, 1.5), "increase of the force with every tenfold speed"),
        Parameter("speed", "m/s", (1e-5, 1.0), LogNormal(0.003, 1.5), "speed below which the force is linear"),
    ),
    absent={"increase": 0.0},
    family="nonlinear viscosity",
    explanation="A damper's force grows by {increase} with every tenfold speed above {speed}; below, it is linear.",
    suspect_when="Loops look like those of dry friction, and every tenfold speed thickens them by the same force.",
    source="Eyring (1936): flow as a process of rates, force in proportion to asinh(v / v₀)",
)
