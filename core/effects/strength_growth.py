"""Hysteresis whose strength grows with displacement, as that of high-damping rubber: Grant, Fenves & Whittaker (2004).

The growth bounds the hysteretic variables, so that the force follows it over the displacement of the yield.
"""

from core.effect import Effect, LogNormal, Parameter


def law(u, u_H):
    share = u / u_H
    return 1.0 + share * share


EFFECT = Effect(
    title="Strength that grows with displacement",
    law=law,
    acts_on="growth",
    parameters=(Parameter("u_H", "m", (1e-2, 1e9), LogNormal(0.2, 0.7), "displacement at which the strength doubles"),),
    absent={"u_H": 1e9},
    family="stiffening at large displacement",
    explanation="The strength of the hysteresis grows with the square of the displacement, and is doubled at {u_H}.",
    suspect_when="Loops become wider towards their ends, the more so the larger they are.",
    source="Grant, Fenves & Whittaker (2004): bounding force that rises with the square of the displacement",
)
