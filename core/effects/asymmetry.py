"""Force that is not odd in the displacement: one side is stiffer than the other."""

from core.effect import Effect, Normal, Parameter


def law(u, tilt, curve):
    return tilt * abs(u) + curve * u * u


EFFECT = Effect(
    title="Asymmetry of the two sides",
    law=law,
    kind="rubber",
    linear=("tilt", "curve"),
    parameters=(
        Parameter(
            "tilt",
            "N/m",
            (-1e12, 1e12),
            Normal(2e7, 5e7),
            "stiffness added on the positive side and removed on the negative",
        ),
        Parameter("curve", "N/m^2", (-1e15, 1e15), Normal(3e8, 1e9), "the same, in proportion to the displacement"),
    ),
    absent={"tilt": 0.0, "curve": 0.0},
    family="difference of the sides",
    explanation="The force differs between the two sides by {tilt} |u| + {curve} u².",
    suspect_when="The loop is not symmetric about the origin.",
    source="Nayfeh & Mook (1979): springs with even terms",
)
