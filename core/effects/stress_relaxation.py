"""Hysteretic force of rubber that relaxes at rest, as Maxwell (1867) for a force: ż = ... − z / τ."""

from core.effect import Effect, LogNormal, Parameter


def law(rate):
    return rate


EFFECT = Effect(
    title="Relaxation of the hysteresis",
    law=law,
    acts_on="relaxing",
    parameters=(Parameter("rate", "1/s", (0.0, 50.0), LogNormal(1.0, 1.0), "share of it that is lost per second"),),
    absent={"rate": 0.0},
    family="relaxation",
    explanation="The hysteretic force relaxes at a rate of {rate:.2g} per second.",
    suspect_when="After a fast excursion the force falls while the layer stands still or creeps back, and slow loops "
    "are narrower than fast ones.",
    source="Maxwell (1867): a force that relaxes; that of the hysteresis alone is an assumption",
)
