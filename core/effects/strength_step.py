"""Lasting change of yielding and sliding forces at one instant: a damper that broke or was replaced."""

from math import tanh

from core.effect import Effect, LogNormal, Normal, Parameter


def law(time, change, date, width):
    return 1.0 + change * 0.5 * (1.0 + tanh((time - date) / width))


EFFECT = Effect(
    title="Step of the yield force",
    law=law,
    acts_on="load",
    sets_in="width",
    forms={"width": (1e4, 1e5, 3e5, 1e6)},  # the usual one is only wide enough for a derivative by the date
    parameters=(
        Parameter("change", "1", (-0.95, 5.0), Normal(-0.2, 0.2), "share of the forces gained, or lost if negative"),
        Parameter("date", "s", (-1e10, 1e10), Normal(4.0, 4.0), "when, after the model's reference instant"),
        Parameter("width", "s", (1e-3, 1e6), LogNormal(0.2, 1.0), "half the time it takes"),
    ),
    absent={"change": 0.0},
    family="softening with use",
    explanation="Yield and sliding forces changed by a share of {change:+.3f} at {date}, and stayed so.",
    suspect_when="Loops of the same amplitude change their height, and not their slope, within a short time, and keep "
    "the new one.",
    source="Basseville & Nikiforov (1993): a change at an unknown instant",
)
