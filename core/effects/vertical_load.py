"""Yield and sliding forces that follow the vertical load: Constantinou, Mokha & Reinhorn (1990), friction by load."""

from core.effect import Effect, Normal, Parameter


def law(axial_load, share):
    return max(1.0 + share * (axial_load - 1.0), 0.0)


EFFECT = Effect(
    title="Vertical load on yield and sliding forces",
    law=law,
    acts_on="load",
    parameters=(
        Parameter(
            "share",
            "1",
            (-10.0, 10.0),
            Normal(0.7, 1.0),
            "relative change of the forces over that of the load",
        ),
    ),
    absent={"share": 0.0},
    family="vertical load",
    explanation="Yield and sliding forces change by {share:+.2f} % for each percent of change in the vertical load.",
    suspect_when="The force has ripples at the frequencies of the vertical motion, in phase with it.",
    source="Constantinou, Mokha & Reinhorn (1990) for sliding; Ryan, Kelly & Chopra (2005) for lead-rubber bearings",
)
