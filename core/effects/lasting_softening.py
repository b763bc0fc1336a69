"""Rubber that softens for good as a power of the largest displacement that it has ever had.

`mullins` describes the same by an exponential, which ends where the rubber is worn in; the power goes on falling.
"""

from math import copysign

from core.effect import Effect, LogNormal, Parameter

CATCHING_UP = 2.5e-3
"""s: short compared with any motion, long enough for steps of a few milliseconds."""


def law(u, v, ever, b, u_r, u_0):
    outwards = v * copysign(1.0, u)
    softer = ((ever + u_r) / (u_0 + u_r)) ** (-b)
    return softer, max(outwards + (abs(u) - ever) / CATCHING_UP, 0.0)


EFFECT = Effect(
    title="Softening by the largest displacement ever",
    law=law,
    states=("ever",),
    carried=("ever",),
    acts_on="softening",
    held=("u_r", "u_0"),  # the stiffness has the same effect, but for small motion of new rubber
    parameters=(
        Parameter("b", "1", (0.0, 1.0), LogNormal(0.12, 0.7), "power by which the stiffness falls"),
        Parameter("u_r", "m", (1e-4, 0.1), LogNormal(4e-3, 0.7), "displacement up to which the rubber is as new"),
        Parameter("u_0", "m", (1e-3, 1.0), LogNormal(0.1, 0.7), "largest displacement at which stiffnesses are given"),
    ),
    absent={"b": 0.0},
    family="softening by past displacement",
    explanation="The rubber's stiffness falls for good as the power −{b:.2f} of the largest displacement that it has "
    "ever had; stiffnesses are those after {u_0}.",
    suspect_when="Small motions are stiffer before each new largest displacement than after it, and later earthquakes "
    "begin as soft as the strongest left the layer.",
    source="Grant, Fenves & Whittaker (2004): permanent scragging of high-damping rubber; the power is an assumption",
)
