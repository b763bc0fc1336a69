"""Rubber that hardens at large strain, as a polynomial: the next odd powers after the linear force."""

from core.effect import Effect, LogNormal, Parameter


def law(u, softening, k3, k5):
    squared = u * u
    return softening * (k3 + k5 * squared) * squared * u


EFFECT = Effect(
    title="Hardening of the rubber",
    law=law,
    kind="rubber",
    linear=("k3", "k5"),
    parameters=(
        Parameter("k3", "N/m^3", (0.0, 1e16), LogNormal(5e9, 2.5), "force over the cube of the displacement"),
        Parameter("k5", "N/m^5", (0.0, 1e20), LogNormal(2e11, 3.0), "force over its fifth power"),
    ),
    absent={"k3": 0.0, "k5": 0.0},
    family="stiffening at large displacement",
    explanation="The rubber stiffens with strain: {k3} u³ + {k5} u⁵ beside its linear force.",
    suspect_when="The ends of the largest loops turn up, on loading and unloading alike; those of small loops do not.",
    source="Nayfeh & Mook (1979): cubic and quintic springs; Kikuchi & Aiken (1997): rubber bearings at large strain",
)
