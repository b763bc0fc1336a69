"""Hysteresis of the rubber itself, in parallel with the damper's: Wen (1976) with n = 1 and β + γ = 1, |z| ≤ 1.

Usually β = γ, so that unloading is straight. Where β exceeds γ by `unloading`, unloading begins steeper by that share.
"""

from core.effect import Effect, LogNormal, Normal, Parameter


def law(v, z_2, growth, relaxing, F_2, D_2, unloading):
    plastic = 0.5 * ((1.0 + unloading) * abs(v) * z_2 + (1.0 - unloading) * v * abs(z_2))
    return F_2 * z_2, (growth * v - plastic) / D_2 - relaxing * z_2


EFFECT = Effect(
    title="Second hysteresis",
    law=law,
    kind="rubber",
    states=("z_2",),
    linear=("F_2",),
    forms={"unloading": (0.5, 1.0)},
    parameters=(
        Parameter("F_2", "N", (0.0, 1e10), LogNormal(1.5e6, 1.5), "force at which it is fully developed"),
        Parameter("D_2", "m", (1e-3, 0.5), LogNormal(2e-2, 1.0), "displacement over which it develops"),
        Parameter("unloading", "1", (-0.9, 2.0), Normal(0.0, 0.5), "share by which unloading begins steeper"),
    ),
    absent={"F_2": 0.0},
    family="parallel hysteresis",
    explanation="A second hysteresis, like that of high-damping rubber, reaches {F_2} and develops over {D_2}.",
    suspect_when="Loops of medium size are wider than the yield of the damper explains, and rounded at their ends.",
    source="Wen (1976), eqs 2-3; in parallel as Iwan (1966) builds distributed yield",
)
