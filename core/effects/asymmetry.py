"""Force that is not odd in the displacement: one side stiffer than the other."""

from core.effect import Effect, Normal, Parameter


def law(u, stiffness, tilt, curve):
    return stiffness * (tilt * abs(u) + curve * u * u)


EFFECT = Effect(
    title="Asymmetry of the two sides",
    law=law,
    linear=("tilt", "curve"),
    parameters=(
        Parameter(
            "tilt", "N/m", (-1e12, 1e12), Normal(2e7, 5e7), "stiffness more on the positive side, less on the other"
        ),
        Parameter("curve", "N/m^2", (-1e15, 1e15), Normal(3e8, 1e9), "the same, growing with the displacement"),
    ),
    absent={"tilt": 0.0, "curve": 0.0},
    family="difference of the sides",
    explanation="The two sides differ: {tilt} |u| + {curve} u² on top of what is alike on both.",
    suspect_when="The loop turned by half a turn does not fall on itself.",
    source="Nayfeh & Mook (1979): springs with even terms",
)
