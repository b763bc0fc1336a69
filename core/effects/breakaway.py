"""Friction that is higher before it slides: Stribeck's curve, as Armstrong-Hélouvry et al. (1994) write it.

An elastic slip comes first, as in sliding friction.
"""

from math import exp

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 4e-3
"""s: a slip faster than that is slowed down to it, since no step of a few milliseconds follows it."""


def law(v, z_b, load, excess, v_s, slip):
    speed = abs(v)
    rate = (v - 0.5 * z_b * (speed * abs(z_b) + v * z_b)) / max(slip, SHORTEST * speed)
    return load * excess * exp(-((v / v_s) * (v / v_s))) * z_b, rate


EFFECT = Effect(
    title="Break-away friction (Stribeck)",
    law=law,
    states=("z_b",),
    linear=("excess",),
    parameters=(
        Parameter("excess", "N", (0.0, 1e9), LogNormal(5e5, 1.5), "force above sliding when sliding begins"),
        Parameter("v_s", "m/s", (1e-4, 0.5), LogNormal(2e-2, 1.0), "speed at which all but 1/e of it is gone"),
        Parameter("slip", "m", (5e-5, 1e-2), LogNormal(5e-4, 0.8), "displacement over which it builds up"),
    ),
    absent={"excess": 0.0},
    family="dry friction",
    explanation="Sliding begins only at {excess} more than it goes on with; beyond {v_s} that is gone "
    "(it builds up over {slip}).",
    suspect_when="The force has a spike just after every reversal, and the layer moves in jerks when slow.",
    source="Armstrong-Hélouvry, Dupont & Canudas de Wit (1994): Stribeck friction",
)
