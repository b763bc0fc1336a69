"""Sharpness of the damper's turn from elastic to yielding: the exponent of Wen (1976)."""

from core.effect import Effect, LogNormal, Parameter


def law(times):
    return times


EFFECT = Effect(
    title="Sharpness of the yield",
    law=law,
    acts_on="sharpness",
    parameters=(
        Parameter(
            "times", "1", (0.3, 20.0), LogNormal(2.0, 0.7), "by which the hysteresis' own exponent n is multiplied"
        ),
    ),
    absent={"times": 1.0},
    family="shape of the yield",
    explanation="The yield is {times:.2f} times as sharp as the model has it: the more, the straighter its sides.",
    suspect_when="Residuals sit at the loop's shoulders, alike on loading from either side, and nowhere else.",
    source="Wen (1976): the exponent n",
)
