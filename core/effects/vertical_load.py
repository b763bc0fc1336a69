"""Yield or sliding force that follows the vertical load: Constantinou, Mokha & Reinhorn (1990) for sliding."""

from core.effect import Effect, Normal, Parameter


def law(axial_load, share):
    return max(1.0 + share * (axial_load - 1.0), 0.0)


EFFECT = Effect(
    title="Vertical load on the yield force",
    law=law,
    acts_on="strength",
    parameters=(
        Parameter("share", "1", (-10.0, 10.0), Normal(0.7, 1.0), "yield force gained by load gained, both as shares"),
    ),
    absent={"share": 0.0},
    family="vertical load",
    explanation="The yield force follows the vertical load: {share:+.2f} % for each percent of it.",
    suspect_when="The force has ripples at the frequencies of the vertical motion, in step with it.",
    source="Constantinou, Mokha & Reinhorn (1990) for sliding; Ryan, Kelly & Chopra (2005) for lead-rubber bearings",
)
