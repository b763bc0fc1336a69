"""A lead core weakens while its own work warms it, and recovers as it cools: Kalpakidis & Constantinou (2009), lumped.

Their warming times their loss of strength per kelvin is one state here. The heat is that of the cold core's strength:
that a weaker core makes less is left to `loss`.
"""

from math import exp

from core.effect import Effect, LogNormal, Parameter


def law(v, yielded, warming, loss, recovery):
    return exp(-warming), loss * yielded * v - warming / recovery


EFFECT = Effect(
    title="Heating of the lead core",
    law=law,
    states=("warming",),
    acts_on="strength",
    parameters=(
        Parameter(
            "loss", "1/m", (0.0, 100.0), LogNormal(0.2, 1.5), "logarithm of the strength lost per metre of travel"
        ),
        Parameter("recovery", "s", (1.0, 1e4), LogNormal(100.0, 1.2), "time in which it cools"),
    ),
    absent={"loss": 0.0},
    family="softening with use",
    explanation="The yield force falls by {loss:.3g} of itself per metre of yielded travel, and comes back in some "
    "{recovery}.",
    suspect_when="Loops grow lower during strong shaking, and are as high again when the next earthquake begins.",
    source="Kalpakidis & Constantinou (2009): temperature of the core from its work, strength falling exponentially",
)
