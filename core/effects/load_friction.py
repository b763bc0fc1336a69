"""Sliding friction under a vertical load that changes: Constantinou, Mokha & Reinhorn (1990), friction by speed.

The damper may already hold the friction under dead load, and the coefficient falls with the pressure: the force under
dead load and its change with the load are thus two parameters. They are equal for a constant coefficient.
"""

from math import exp

from core.effect import Effect, LogNormal, Normal, Parameter

SHORTEST = 1.0
"""Integration steps: a slip faster than this is slowed down to it. The method of Runge and Kutta is stable from 0.72
on; below, the derivatives by the parameters grow while the force slides."""


def law(v, axial_load, step, z_l, sliding, following, share, a, slip, direct):
    speed = abs(v)
    wen = 0.5 * z_l * (speed * abs(z_l) + v * z_l)
    rate = (v - wen - direct * (speed * z_l - wen)) / max(slip, SHORTEST * step * speed)
    fast = sliding + following * (max(axial_load, 0.0) - 1.0)
    return fast * (1.0 - share * exp(-a * speed)) * z_l, rate


EFFECT = Effect(
    title="Sliding friction that follows the vertical load",
    law=law,
    kind="sliding",
    states=("z_l",),
    linear=("sliding", "following"),
    forms={"direct": (0.5, 1.0)},
    special={"following": 0.0},
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast under dead load"),
        Parameter("following", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "its change over the relative change of the load"),
        Parameter("share", "1", (-0.5, 0.99), Normal(0.3, 0.3), "share of it that is missing in slow sliding"),
        Parameter("a", "s/m", (1.0, 500.0), LogNormal(30.0, 1.0), "rate at which it grows with the speed"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which sliding begins"),
        Parameter("direct", "1", (-0.1, 1.1), Normal(0.0, 0.5), "form of the slip: 0 of Wen, 1 of Dahl"),
    ),
    absent={"sliding": 0.0, "following": 0.0},
    family="vertical load",
    explanation="Sliding friction: {sliding} at high speed under dead load, and {following} times the relative change "
    "of the vertical load; less by a share of {share:.2f} at low speed.",
    suspect_when="The force has ripples at the frequencies of the vertical motion, of the same height at any "
    "displacement, and they change their sign with the velocity.",
    source="Constantinou, Mokha & Reinhorn (1990): friction by vertical load, speed and pressure; Wen (1976) and Dahl "
    "(1968) for the slip",
)
