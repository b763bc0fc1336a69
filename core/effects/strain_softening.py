"""Stiffness and damping that fall with the displacement: Kondner (1963), the hyperbola, for the stiffness.

They depend on the displacement at each instant. Payne's (1962) effect in filled rubber depends on the amplitude of the
cycle; as a model of it, this law is an approximation that also bends the loop within each cycle.
"""

from core.effect import Effect, LogNormal, Parameter


def law(u, v, k_s, c_s, u_s):
    return (k_s * u + c_s * v) / (1.0 + abs(u) / u_s)


EFFECT = Effect(
    title="Stiffness and damping that fall with displacement",
    law=law,
    kind="rubber",
    linear=("k_s", "c_s"),
    parameters=(
        Parameter("k_s", "N/m", (0.0, 1e12), LogNormal(1e8, 1.5), "stiffness lost at large displacement"),
        Parameter("c_s", "N s/m", (0.0, 1e11), LogNormal(3e6, 1.5), "damping lost at large displacement"),
        Parameter("u_s", "m", (5e-4, 1.0), LogNormal(2e-2, 1.0), "displacement at which half of both is lost"),
    ),
    absent={"k_s": 0.0, "c_s": 0.0},
    family="strain dependence",
    explanation="In small motion the rubber has an additional {k_s} and {c_s}; half of both is left at {u_s}.",
    suspect_when="Equivalent stiffness and damping fall with the amplitude, and return at once in the next small "
    "motion.",
    source="Kondner (1963): hyperbola of stress against strain; that the damping falls in the same way is an "
    "assumption",
)
