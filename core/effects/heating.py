"""Lead core that weakens as its own work warms it, and recovers as it cools: Kalpakidis & Constantinou (2009), lumped.

The state is their temperature rise times their loss of strength per kelvin. The heat is that of the cold core's
strength; `loss` absorbs that a weaker core produces less. The strength falls exponentially with the temperature, or in
another form as 1 / (1 + form x)^(1 / form) with the state x: with 1 it is inversely proportional.
"""

from math import exp, log1p

from core.effect import Effect, LogNormal, Normal, Parameter

EXPONENTIAL = 1e-6
"""Below it, the first terms of the series in `form` are exact to rounding."""
FURTHEST = -0.9
"""Least `form` times the state: a negative form ends at -1."""


def law(v, yielded, warming, loss, recovery, form):
    if abs(form) < EXPONENTIAL:
        weaker = warming - 0.5 * form * warming * warming
    else:
        weaker = log1p(max(form * warming, FURTHEST)) / form
    return exp(-weaker), loss * yielded * v - warming / recovery


EFFECT = Effect(
    title="Heating of the lead core",
    law=law,
    states=("warming",),
    acts_on="strength",
    forms={"form": (0.5, 1.0, 2.0)},
    parameters=(
        Parameter(
            "loss", "1/m", (0.0, 100.0), LogNormal(0.2, 1.5), "logarithm of the strength lost per metre of travel"
        ),
        Parameter("recovery", "s", (1.0, 1e4), LogNormal(100.0, 1.2), "time constant of cooling"),
        Parameter(
            "form", "1", (-0.2, 5.0), Normal(0.0, 1.0), "form of the fall: 0 exponential, 1 inversely proportional"
        ),
    ),
    absent={"loss": 0.0},
    family="softening with use",
    explanation="The yield force falls by a share of {loss:.3g} per metre of yielded travel, and recovers in about "
    "{recovery}.",
    suspect_when="Loops become lower during strong shaking, and have recovered when the next earthquake begins.",
    source="Kalpakidis & Constantinou (2009): temperature of the core from its work, strength falling exponentially",
)
