"""Friction that is higher when sliding begins: Stribeck's curve, after Armstrong-Hélouvry et al. (1994).

An elastic slip comes first, of Wen (1976) with n = 2, or in another form of Dahl (1968). The excess is Gaussian in the
speed v, or in another form 1 / (1 + form (v / v_s)²)^(1 / form): with 1 that of Hess & Soom (1990).
"""

from math import exp, log1p

from core.effect import Effect, LogNormal, Normal, Parameter

SHORTEST = 4e-3
"""s: a slip faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""

GAUSSIAN = 1e-6
"""Below it, the first terms of the series in `form` are exact to rounding."""
FURTHEST = -0.9
"""Least `form` times the square of the speed: a negative form ends at -1."""


def law(v, z_b, excess, v_s, slip, form, direct):
    speed = abs(v)
    wen = 0.5 * z_b * (speed * abs(z_b) + v * z_b)
    rate = (v - wen - direct * (speed * z_b - wen)) / max(slip, SHORTEST * speed)
    faster = (v / v_s) * (v / v_s)
    if abs(form) < GAUSSIAN:
        faded = faster - 0.5 * form * faster * faster
    else:
        faded = log1p(max(form * faster, FURTHEST)) / form
    return excess * exp(-faded) * z_b, rate


EFFECT = Effect(
    title="Break-away friction (Stribeck)",
    law=law,
    kind="sliding",
    states=("z_b",),
    linear=("excess",),
    forms={"direct": (0.5, 1.0), "form": (0.5, 1.0, 2.0)},
    parameters=(
        Parameter("excess", "N", (0.0, 1e9), LogNormal(5e5, 1.5), "excess over the sliding force when sliding begins"),
        Parameter("v_s", "m/s", (1e-4, 0.5), LogNormal(2e-2, 1.0), "speed at which 1/e of it is left"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which it builds up"),
        Parameter("form", "1", (-0.2, 5.0), Normal(0.0, 1.0), "form of the fall with the speed: 0 Gaussian, 1 of Hess"),
        Parameter("direct", "1", (-0.1, 1.1), Normal(0.0, 0.5), "form of the slip: 0 of Wen, 1 of Dahl"),
    ),
    absent={"excess": 0.0},
    family="dry friction",
    explanation="Sliding begins at {excess} above the sliding force. The excess fades at speeds above {v_s}; it "
    "builds up over {slip}.",
    suspect_when="The force has a spike just after each reversal, and the layer moves in jerks at low speed.",
    source="Armstrong-Hélouvry, Dupont & Canudas de Wit (1994): Stribeck friction; Hess & Soom (1990)",
)
