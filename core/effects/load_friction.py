"""Sliding friction under a vertical load that changes: Constantinou, Mokha & Reinhorn (1990), friction by speed.

The damper may already hold the friction under dead load, and the coefficient falls with the pressure: the force under
dead load and its change with the load are thus two parameters. They are equal for a constant coefficient. The slip is
that of friction which does not follow the load, from round to sharp, or as with Dahl (1968). With a round corner the
load multiplies the force at every instant. The sharper the corner, the more the load moves the bound of the force
instead: a sharp slider that sticks is a spring, whatever the load (Simo & Hughes 1998).
"""

from math import exp

from core.effect import Effect, LogNormal, Normal, Parameter

ROUND = 2.0
"""Corner of Constantinou et al. (1990)."""
STILL_ROUND = 3.0
"""Corner up to which the load multiplies the force; from then on it moves the bound, the more the sharper. A choice."""
SHORTEST = 0.38
"""Share of an integration step: the variable comes to its bound no faster than within this. The method of Runge and
Kutta is stable from 0.36 on; below, the derivatives by the parameters grow where the force is at its bound."""
AT_BOUND = 1e-3
"""1/s: where the variable nears its bound more slowly, rounding must not decide whether that is too fast."""
LIFTED = 1e-6
"""Load, over the dead load, by which the bound of a bearing without load is not zero. A choice."""
FURTHEST = 10.0
"""Ratio of the variable to its bound above which the return is no faster: its power must stay finite. A choice."""


def law(v, axial_load, step, z_l, sliding, following, share, a, slip, corner, unloading):
    speed = abs(v)
    strength = 1.0 - share * exp(-a * speed)
    scale = strength ** (ROUND / corner)
    moved = max(axial_load, LIFTED) ** (1.0 - min(1.0, STILL_ROUND / corner))
    bound = strength / scale * moved
    along = z_l if v >= 0.0 else -z_l
    if along > 0.0:
        bend = min(along / bound, FURTHEST) ** corner
    else:
        bend = 0.0 if unloading == 0.0 else -unloading * min(-along / bound, FURTHEST) ** corner
    rate = speed / slip * (1.0 - bend)
    shortest = SHORTEST * step
    nearing = (bound - along) / shortest
    is_steep = corner * speed * shortest > slip * bound
    if abs(rate) > abs(nearing) or (is_steep and abs(nearing) < AT_BOUND):
        rate = nearing
    fast = sliding + following * (max(axial_load, 0.0) - 1.0)
    return fast / moved * scale * z_l, rate if v >= 0.0 else -rate


EFFECT = Effect(
    title="Sliding friction that follows the vertical load",
    law=law,
    kind="sliding",
    states=("z_l",),
    linear=("sliding", "following"),
    forms={"unloading": (0.5, 1.0)},
    special={"following": 0.0},
    open_ended=("corner",),
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast under dead load"),
        Parameter("following", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "its change over the relative change of the load"),
        Parameter("share", "1", (-0.5, 0.99), Normal(0.3, 0.3), "share of it that is missing in slow sliding"),
        Parameter("a", "s/m", (1.0, 500.0), LogNormal(30.0, 1.0), "rate at which it grows with the speed"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which sliding begins"),
        Parameter("corner", "1", (1.0, 100.0), LogNormal(2.0, 1.0), "sharpness of that: 2 is round, from 10 on sharp"),
        Parameter("unloading", "1", (-0.9, 2.0), Normal(0.0, 0.5), "share by which unloading begins steeper"),
    ),
    absent={"sliding": 0.0, "following": 0.0},
    family="vertical load",
    explanation="Sliding friction: {sliding} at high speed under dead load, and {following} times the relative change "
    "of the vertical load; less by a share of {share:.2f} at low speed.",
    suspect_when="The force has ripples at the frequencies of the vertical motion, of the same height at any "
    "displacement, and they change their sign with the velocity.",
    source="Constantinou, Mokha & Reinhorn (1990): friction by vertical load, speed and pressure; Wen (1976) and Dahl "
    "(1968) for the slip; Simo & Hughes (1998) for a sharp corner",
)
