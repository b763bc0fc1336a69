"""The rubber's forces change at one instant, and stay changed: a tear, a stop that broke, a bearing replaced."""

from math import tanh

from core.effect import Effect, Normal, Parameter


def law(time, change, date, width):
    return 1.0 + change * 0.5 * (1.0 + tanh((time - date) / width))


EFFECT = Effect(
    title="Step of the stiffness",
    law=law,
    acts_on="stiffness",
    held=("width",),  # only so wide that the date has a derivative
    parameters=(
        Parameter("change", "1", (-0.95, 5.0), Normal(-0.1, 0.15), "share of stiffness gained, or lost if negative"),
        Parameter("date", "s", (-1e10, 1e10), Normal(4.0, 4.0), "when, after the model's reference instant"),
        Parameter("width", "s", (1e-3, 1e6), Normal(0.2, 0.2), "half the time it takes"),
    ),
    absent={"change": 0.0},
    family="softening with use",
    explanation="The rubber's stiffness changed by a share of {change:+.3f} at {date:.7g} s after the model's "
    "reference instant, and stayed so.",
    suspect_when="The stiffness at small amplitude leaps between two instants, and neither comes back nor goes on.",
    source="Basseville & Nikiforov (1993): a change at an unknown instant",
)
