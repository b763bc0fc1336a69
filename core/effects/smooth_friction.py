"""Friction without a break at rest: it grows from nothing to a limit over a speed, as creeping or lubricated contacts
and many simulations have it. Andersson, Söderberg & Björklund (2007): Coulomb friction smoothed by tanh.

In another form it grows exponentially, as with Threlfall (1978); in between it is a logistic function.
"""

from math import copysign, exp

from core.effect import Effect, LogNormal, Normal, Parameter


def law(v, sliding, speed, shape):
    missing = exp(-2.0 * abs(v) / speed)
    return sliding * copysign((1.0 - missing) / (1.0 + shape * missing), v)


EFFECT = Effect(
    title="Friction that grows smoothly with speed",
    law=law,
    linear=("sliding",),
    forms={"shape": (0.0,)},
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast"),
        Parameter("speed", "m/s", (1e-4, 0.5), LogNormal(0.01, 1.0), "speed at which three quarters of it act"),
        Parameter("shape", "1", (-0.9, 5.0), Normal(1.0, 0.5), "1 where it grows as tanh, 0 as an exponential"),
    ),
    absent={"sliding": 0.0},
    family="dry friction",
    explanation="Smooth friction: {sliding} at high speed, three quarters of it at {speed}, none at rest.",
    suspect_when="Fast loops have a flat top and bottom, as of dry friction; slow ones are ellipses that fade with the "
    "speed, and the isolators creep back to their rest position.",
    source="Andersson, Söderberg & Björklund (2007), Coulomb friction smoothed by tanh; Threlfall (1978), exponential",
)
