"""Rubber is stiffer in the cold: exponential in the temperature, as makers of bearings state it."""

from math import exp

from core.effect import Effect, Normal, Parameter


def law(temperature, stiffening, reference):
    return exp(stiffening * (reference - temperature))


EFFECT = Effect(
    title="Temperature on the rubber's forces",
    law=law,
    acts_on="stiffness",
    held=("reference",),  # the temperature for which the stiffness is given
    parameters=(
        Parameter(
            "stiffening", "1/°C", (-0.1, 0.1), Normal(0.003, 0.005), "share of stiffness gained per degree colder"
        ),
        Parameter("reference", "°C", (-60.0, 60.0), Normal(20.0, 10.0), "temperature for which the stiffness is given"),
    ),
    absent={"stiffening": 0.0},
    family="temperature",
    explanation="The rubber stiffens by a share of {stiffening:.4f} for each degree below {reference:.0f} °C.",
    suspect_when="Small motions are stiffer in winter than in summer, by the same share at any amplitude.",
    source="Constantinou, Whittaker, Kalpakidis, Fenz & Warn (2007): effect of temperature on bearings",
)
