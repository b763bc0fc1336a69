"""Lead core that weakens as work in both directions warms it: Kalpakidis & Constantinou (2009), lumped.

The other direction's hysteretic variable is a state here, driven by the motion there; with the one in this direction it
follows the circle of Park, Wen & Ang (1986), as lead does. Without motion in the other direction the core warms by its
own direction alone. For other forms than the exponential one see `heating`.
"""

from math import exp, log1p

from core.effect import Effect, LogNormal, Normal, Parameter

D_LEAD = 5e-3
"""m, usual yield displacement of lead in the other direction. Heat comes from travels that are long compared with it: a
tenth more or less changes the heat's effect by 3e-4."""
SHORTEST = 2e-3
"""s: a yield faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""

EXPONENTIAL = 1e-6
"""Below it, the first terms of the series in `form` are exact to rounding."""
FURTHEST = -0.9
"""Least `form` times the state: a negative form ends at -1."""


def law(v, v_cross, yielded, warming, z_cross, loss, recovery, form):
    if abs(form) < EXPONENTIAL:
        weaker = warming - 0.5 * form * warming * warming
    else:
        weaker = log1p(max(form * warming, FURTHEST)) / form
    used = max(v_cross * z_cross, 0.0) + max(v * yielded, 0.0)
    reach = max(D_LEAD, SHORTEST * (abs(v_cross) + used))
    power = yielded * v + z_cross * v_cross
    return exp(-weaker), loss * power - warming / recovery, (v_cross - used * z_cross) / reach


EFFECT = Effect(
    title="Heating of the lead core by motion in both directions",
    law=law,
    states=("warming", "z_cross"),
    acts_on="strength",
    forms={"form": (0.5, 1.0, 2.0)},
    parameters=(
        Parameter(
            "loss", "1/m", (0.0, 100.0), LogNormal(0.2, 1.5), "logarithm of the strength lost per metre of travel"
        ),
        Parameter("recovery", "s", (1.0, 1e4), LogNormal(100.0, 1.2), "time constant of cooling"),
        Parameter("form", "1", (-0.2, 5.0), Normal(0.0, 1.0), "form of the fall, as of heating: 0 exponential"),
    ),
    absent={"loss": 0.0},
    family="softening with use",
    explanation="The yield force falls by a share of {loss:.3g} per metre of yielded travel in either direction, and "
    "recovers in about {recovery}.",
    suspect_when="Loops become lower while the layer moves strongly in the other direction, and have recovered when "
    "the next earthquake begins.",
    source="Kalpakidis & Constantinou (2009): heat of motion in two directions; Park, Wen & Ang (1986)",
)
