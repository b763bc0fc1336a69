"""Sliding friction whose coefficient grows with speed, after an elastic slip: from round to sharp.

With a corner of 2 the law is that of Constantinou et al. (1990): Wen's (1976) variable times a strength that grows with
the speed. With a sharp corner it is that of sliding elements with a return mapping (Simo & Hughes 1998): the slider is
a spring of one stiffness until the strength at its speed bounds the force. In between, the strength is divided: its
power 2 / corner scales the force, and the rest bounds the variable. In other forms unloading begins steeper, as with
Dahl (1968), and the bound is higher by a share before it slides, which fades as a Gaussian of the speed. With both, and
a corner of 1, it is the law of Canudas de Wit et al. (1995) without its viscosity.
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


def law(v, step, z_f, sliding, share, a, slip, corner, unloading, sticking):
    speed = abs(v)
    strength = 1.0 - share * exp(-a * speed)
    scale = strength ** (ROUND / corner)
    bound = strength / scale
    bound += 0.0 if sticking == 0.0 else sticking * exp(-(a * speed) * (a * speed))
    along = z_f if v >= 0.0 else -z_f
    if along > 0.0:
        bend = (along / bound) ** corner
    else:
        bend = 0.0 if unloading == 0.0 else -unloading * (-along / bound) ** corner
    rate = speed / slip * (1.0 - bend)
    shortest = SHORTEST * step
    nearing = (bound - along) / shortest
    is_steep = corner * speed * shortest > slip * bound
    if abs(rate) > abs(nearing) or (is_steep and abs(nearing) < AT_BOUND):
        rate = nearing
    return sliding * scale * z_f, rate if v >= 0.0 else -rate


EFFECT = Effect(
    title="Friction",
    law=law,
    kind="sliding",
    states=("z_f",),
    linear=("sliding",),
    forms={"unloading": (0.5, 1.0), "sticking": (0.2, 0.6)},
    open_ended=("corner",),
    parameters=(
        Parameter("sliding", "N", (0.0, 1e9), LogNormal(1e6, 1.5), "force while sliding fast"),
        Parameter("share", "1", (1e-3, 0.99), LogNormal(0.4, 0.7), "share of it that is missing in slow sliding"),
        Parameter("a", "s/m", (1.0, 500.0), LogNormal(30.0, 1.0), "rate at which it grows with the speed"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which sliding begins"),
        Parameter("corner", "1", (1.0, 100.0), LogNormal(2.0, 1.0), "sharpness of that: 2 is round, from 10 on sharp"),
        Parameter("unloading", "1", (-0.9, 2.0), Normal(0.0, 0.5), "share by which unloading begins steeper"),
        Parameter(
            "sticking", "1", (-1e-3, 3.0), Normal(0.0, 0.3), "share by which the bound is higher before it slides"
        ),
    ),
    absent={"sliding": 0.0},
    family="dry friction",
    explanation="Sliding friction: {sliding} at high speed, less by a share of {share:.2f} at low speed (it grows "
    "with exp(-{a} times the speed)), reached within {slip} of each reversal.",
    suspect_when="The loop has steep sides at each reversal, however small the motion, and the same height at any "
    "displacement.",
    source="Constantinou, Mokha & Reinhorn (1990), coefficient of friction against speed; Wen (1976) for the slip; "
    "Simo & Hughes (1998) for a sharp corner; Canudas de Wit et al. (1995) for sticking",
)
