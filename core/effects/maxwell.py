"""Spring and dashpot in series, whose force relaxes: Maxwell (1867)."""

from core.effect import Effect, LogNormal, Parameter


def law(v, stretch, K, tau):
    return K * stretch, v - stretch / tau


EFFECT = Effect(
    title="Maxwell element",
    law=law,
    states=("stretch",),
    linear=("K",),
    parameters=(
        Parameter("K", "N/m", (0.0, 1e12), LogNormal(5e7, 1.5), "stiffness in fast motion"),
        Parameter("tau", "s", (1e-2, 20.0), LogNormal(0.3, 1.2), "relaxation time of the force"),
    ),
    absent={"K": 0.0},
    family="relaxation",
    explanation="A spring of {K} in series with a dashpot relaxes in {tau}; it is stiff in fast motion only.",
    suspect_when="The layer is stiffer at higher frequencies, and its damping is lower there.",
    source="Maxwell (1867); Makris & Constantinou (1991) for fluid dampers",
)
