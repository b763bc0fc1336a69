"""Restoring force of a friction pendulum, which follows the vertical load: Zayas, Low & Mahin (1990), N u / R.

Beside rubber, the stiffness under dead load is divided between both; only the pendulum's share has the load's ripples.
"""

from core.effect import Effect, LogNormal, Parameter


def law(u, axial_load, hanging):
    return hanging * max(axial_load, 0.0) * u


EFFECT = Effect(
    title="Pendulum under the vertical load",
    law=law,
    linear=("hanging",),
    parameters=(
        Parameter("hanging", "N/m", (0.0, 1e12), LogNormal(1e8, 2.0), "dead load over the radius of the dish"),
    ),
    absent={"hanging": 0.0},
    family="pendulum stiffness",
    explanation="A pendulum restores with {hanging} under dead load, in proportion to the vertical load of the moment.",
    suspect_when="The force has ripples at the frequencies of the vertical motion that grow with the displacement and "
    "change their sign with it.",
    source="Zayas, Low & Mahin (1990); Constantinou, Mokha & Reinhorn (1990): N u / R",
)
