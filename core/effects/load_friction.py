"""Sliding friction under a vertical load that changes: Constantinou, Mokha & Reinhorn (1990), friction by speed.

The coefficient falls with the pressure, and a part of the friction may carry no load: how much of the load's change the
force follows is thus a parameter, 1 for a constant coefficient. The slip and its forms are those of friction that does
not follow the load. With a round corner the load multiplies the force; with a sharp one it moves the bound, and the
force of a slider that sticks does not change with it.
"""

from math import exp

from core.effect import Effect, LogNormal, Normal, Parameter

ROUND = 2.0
"""Corner of Constantinou et al. (1990)."""
SHORTEST = 0.38
"""Share of an integration step: the variable comes to its bound no faster than within this. The method of Runge and
Kutta is stable from 0.36 on; below, the derivatives by the parameters grow where the force is at its bound."""
AT_BOUND = 1e-3
"""1/s: where the variable nears its bound more slowly, rounding must not decide whether that is too fast."""
LIFTED = 1e-6
"""Share of the strength that is left to a bearing without load, so that its bound is not zero. A choice."""
FURTHEST = 10.0
"""Ratio of the variable to its bound above which the return is no faster: its power must stay finite. A choice."""


def law(v, axial_load, step, z_l, sliding, following, share, a, slip, corner, unloading, sticking):
    speed = abs(v)
    pressed = 1.0 + following * (max(axial_load, 0.0) - 1.0)
    strength = max(pressed * (1.0 - share * exp(-a * speed)), LIFTED)
    scale = strength ** (ROUND / corner)
    bound = strength / scale
    bound += 0.0 if sticking == 0.0 else sticking * exp(-(a * speed) * (a * speed))
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
    return sliding * scale * z_l, rate if v >= 0.0 else -rate


EFFECT = Effect(
    title="Sliding friction that follows the vertical load",
    law=law,
    kind="sliding",
    states=("z_l",),
    linear=("sliding",),
    forms={"unloading": (0.5, 1.0), "sticking": (0.2, 0.6)},
    special={"following": 0.0},
    open_ended=("corner",),
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast under dead load"),
        Parameter("following", "1", (0.0, 10.0), Normal(1.0, 0.5), "its relative change over that of the load"),
        Parameter("share", "1", (-0.5, 0.99), Normal(0.3, 0.3), "share of it that is missing in slow sliding"),
        Parameter("a", "s/m", (1.0, 500.0), LogNormal(30.0, 1.0), "rate at which it grows with the speed"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which sliding begins"),
        Parameter("corner", "1", (1.0, 100.0), LogNormal(2.0, 1.0), "sharpness of that: 2 is round, from 10 on sharp"),
        Parameter("unloading", "1", (-0.9, 2.0), Normal(0.0, 0.5), "share by which unloading begins steeper"),
        Parameter(
            "sticking", "1", (-1e-3, 3.0), Normal(0.0, 0.3), "share by which the bound is higher before it slides"
        ),
    ),
    absent={"sliding": 0.0},
    family="vertical load",
    explanation="Sliding friction: {sliding} at high speed under dead load, which changes by {following:.2f} % for "
    "each percent of change in the vertical load; less by a share of {share:.2f} at low speed.",
    suspect_when="The force has ripples at the frequencies of the vertical motion, of the same height at any "
    "displacement, and they change their sign with the velocity.",
    source="Constantinou, Mokha & Reinhorn (1990): friction by vertical load, speed and pressure; Wen (1976) for the "
    "slip; Simo & Hughes (1998) for a sharp corner",
)
