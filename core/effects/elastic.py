"""The rubber's elastic force k_b x_b (paper, eq 9)."""

from core.effect import Effect, LogNormal, Parameter


def law(u, softening, k_b):
    return softening * k_b * u


def stiffness_after_yield(k_b):
    return k_b


EFFECT = Effect(
    title="Elastic stiffness",
    law=law,
    kind="rubber",
    parameters=(Parameter("k_b", "N/m", (0.0, 1e12), LogNormal(1e8, 2.0), "stiffness of the rubber after yield"),),
    absent={"k_b": 0.0},
    linear=("k_b",),
    design={"k_b": stiffness_after_yield},
    family="elasticity",
    explanation="The rubber has a stiffness of {k_b}.",
    suspect_when="The force rises in proportion to the displacement.",
    source="the paper, eq 9",
)
