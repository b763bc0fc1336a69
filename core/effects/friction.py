"""Sliding friction whose coefficient grows with speed: Constantinou et al. (1990), after an elastic slip.

The slip's variable is theirs, with η = 2.
"""

from math import exp

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 4e-3
"""s: a slip faster than that is slowed down to it, since no step of a few milliseconds follows it."""


def law(v, z_f, load, sliding, share, a, slip):
    speed = abs(v)
    rate = (v - 0.5 * z_f * (speed * abs(z_f) + v * z_f)) / max(slip, SHORTEST * speed)
    return load * sliding * (1.0 - share * exp(-a * speed)) * z_f, rate


EFFECT = Effect(
    title="Friction",
    law=law,
    states=("z_f",),
    linear=("sliding",),
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast"),
        Parameter(
            "share", "1", (1e-3, 0.99), LogNormal(0.4, 0.7), "share of it that is not there while sliding slowly"
        ),
        Parameter("a", "s/m", (1.0, 500.0), LogNormal(30.0, 1.0), "how soon speed brings it"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which sliding begins"),
    ),
    absent={"sliding": 0.0},
    family="dry friction",
    explanation="Something slides: {sliding} against the motion when fast, a share of {share:.2f} less when slow "
    "(it grows with exp(-{a} times the speed)), reached within {slip} of every reversal.",
    suspect_when="The loop has steep sides at every reversal, however small the motion, and the same height at any "
    "displacement.",
    source="Constantinou, Mokha & Reinhorn (1990), coefficient of friction against speed; Wen (1976) for the slip",
)
