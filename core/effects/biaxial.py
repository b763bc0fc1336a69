"""Interaction of the two directions in yielding: Park, Wen & Ang (1986).

The other direction's hysteretic variable is a state here, driven by the motion there. Both follow Wen (1976) with n = 1
and β = γ = 1/2; the terms of each equation that contain the other variable are multiplied by the coupling.
"""

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 2e-3
"""s: a yield faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""


def law(v, v_cross, yielded, z_cross, joined, D_cross):
    used = joined * max(v * yielded, 0.0)
    plastic = 0.5 * (abs(v_cross) * z_cross + v_cross * abs(z_cross)) + used * z_cross
    reach = max(D_cross, SHORTEST * (abs(v_cross) + used))
    return joined * max(v_cross * z_cross, 0.0), (v_cross - plastic) / reach


EFFECT = Effect(
    title="Coupling of the two directions",
    law=law,
    states=("z_cross",),
    acts_on="cross_flow",
    parameters=(
        Parameter("joined", "1", (0.0, 2.0), LogNormal(0.8, 0.7), "coupling; 0: none, 1: the full interaction"),
        Parameter("D_cross", "m", (1e-3, 0.5), LogNormal(3e-3, 1.0), "yield displacement in the other direction"),
    ),
    absent={"joined": 0.0},
    family="shape of the yield",
    explanation="Motion in the other direction (yield displacement {D_cross}) reduces the strength in this one, with "
    "a coupling of {joined:.2f}.",
    suspect_when="The yield force is low while the layer moves fast in the other direction.",
    source="Park, Wen & Ang (1986): coupled equations of the two hysteretic variables",
)
