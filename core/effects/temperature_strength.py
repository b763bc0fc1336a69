"""Lead yields, and surfaces slide, at a higher force in the cold: Kalpakidis & Constantinou (2009), exponential in the
temperature.
"""

from math import exp

from core.effect import Effect, Normal, Parameter


def law(temperature, strengthening, reference):
    return exp(strengthening * (reference - temperature))


EFFECT = Effect(
    title="Temperature on yield and sliding forces",
    law=law,
    acts_on="load",
    held=("reference",),  # the temperature for which the forces are given
    parameters=(
        Parameter(
            "strengthening", "1/°C", (-0.1, 0.1), Normal(0.007, 0.007), "share of strength gained per degree colder"
        ),
        Parameter("reference", "°C", (-60.0, 60.0), Normal(20.0, 10.0), "temperature for which the forces are given"),
    ),
    absent={"strengthening": 0.0},
    family="temperature",
    explanation="Yield and sliding forces grow by a share of {strengthening:.4f} for each degree below "
    "{reference:.0f} °C.",
    suspect_when="Loops of the same amplitude are higher in winter than in summer, with equal slopes.",
    source="Kalpakidis & Constantinou (2009): yield stress of lead falls by exp(-0.0069 per °C); Kumar, Whittaker & "
    "Constantinou (2015): friction of PTFE on steel falls by 0.005 per °C at 20 °C",
)
