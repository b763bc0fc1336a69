"""Sharpness of the transition from elastic to yielding: the exponent of Wen (1976)."""

from core.effect import Effect, LogNormal, Parameter


def law(times):
    return times


EFFECT = Effect(
    title="Sharpness of the yield",
    law=law,
    acts_on="sharpness",
    open_ended=("times",),
    parameters=(
        Parameter("times", "1", (0.3, 60.0), LogNormal(2.0, 0.7), "factor of the exponent n of the hysteresis"),
    ),
    absent={"times": 1.0},
    family="shape of the yield",
    explanation="The transition to yielding is {times:.2f} times as sharp as in the model.",
    suspect_when="Residuals occur at the shoulders of the loop, alike for loading from either side, and nowhere else.",
    source="Wen (1976): the exponent n",
)
