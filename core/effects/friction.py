"""Sliding friction whose coefficient grows with speed: Constantinou et al. (1990), after an elastic slip.

The variable of the slip is theirs, with η = 2.
"""

from math import exp

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 4e-3
"""s: a slip faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""


def law(v, z_f, sliding, share, a, slip):
    speed = abs(v)
    rate = (v - 0.5 * z_f * (speed * abs(z_f) + v * z_f)) / max(slip, SHORTEST * speed)
    return sliding * (1.0 - share * exp(-a * speed)) * z_f, rate


EFFECT = Effect(
    title="Friction",
    law=law,
    kind="sliding",
    states=("z_f",),
    linear=("sliding",),
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast"),
        Parameter("share", "1", (1e-3, 0.99), LogNormal(0.4, 0.7), "share of it that is missing in slow sliding"),
        Parameter("a", "s/m", (1.0, 500.0), LogNormal(30.0, 1.0), "rate at which it grows with the speed"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which sliding begins"),
    ),
    absent={"sliding": 0.0},
    family="dry friction",
    explanation="Sliding friction: {sliding} at high speed, less by a share of {share:.2f} at low speed (it grows "
    "with exp(-{a} times the speed)), reached within {slip} of each reversal.",
    suspect_when="The loop has steep sides at each reversal, however small the motion, and the same height at any "
    "displacement.",
    source="Constantinou, Mokha & Reinhorn (1990), coefficient of friction against speed; Wen (1976) for the slip",
)
