"""Interaction of the two directions in yielding: Park, Wen & Ang (1986), or yielding on a circle (Casciati, 1989).

The other direction's hysteretic variable is a state here, driven by the motion there. Both follow Wen (1976) with n = 1
and β = γ = 1/2; the terms of each equation that contain the other variable are multiplied by the coupling. On the
circle the plastic flow is the power of both directions over the length of both variables together, and the coupling is
the ratio of the two yield displacements: it multiplies the motion in the other direction. `circle` mixes the two forms.
"""

from math import hypot

from core.effect import Effect, LogNormal, Normal, Parameter

SHORTEST = 2e-3
"""s: a yield faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""


TINY = 1e-9
"""Smaller variables have this length together."""


def law(v, v_cross, yielded, z_cross, joined, D_cross, circle):
    used, added = joined * max(v * yielded, 0.0), joined * max(v_cross * z_cross, 0.0)
    plastic = 0.5 * (abs(v_cross) * z_cross + v_cross * abs(z_cross)) + used * z_cross
    rate = v_cross - plastic
    across = joined * v_cross
    around = max(v * yielded + across * z_cross, 0.0) / max(hypot(yielded, z_cross), TINY)
    alone = max(v if yielded >= 0.0 else -v, 0.0)
    rate += circle * (across - around * z_cross - rate)
    added += circle * (around - alone - added)
    return added, rate / max(D_cross, SHORTEST * (abs(v_cross) + used))


EFFECT = Effect(
    title="Coupling of the two directions",
    law=law,
    states=("z_cross",),
    acts_on="cross_flow",
    forms={"circle": (1.0,)},
    parameters=(
        Parameter("joined", "1", (0.0, 2.0), LogNormal(0.8, 0.7), "coupling; 0: none, 1: the full interaction"),
        Parameter("D_cross", "m", (1e-3, 0.5), LogNormal(3e-3, 1.0), "yield displacement in the other direction"),
        Parameter("circle", "1", (-0.1, 1.1), Normal(0.0, 0.5), "form: 0 of Park, Wen and Ang, 1 yielding on a circle"),
    ),
    absent={"joined": 0.0},
    family="shape of the yield",
    explanation="Motion in the other direction (yield displacement {D_cross}) reduces the strength in this one, with "
    "a coupling of {joined:.2f}.",
    suspect_when="The yield force is low while the layer moves fast in the other direction.",
    source="Park, Wen & Ang (1986): coupled equations of the two hysteretic variables; Casciati (1989)",
)
