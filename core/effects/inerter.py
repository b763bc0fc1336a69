"""A device whose force follows the relative acceleration of its ends: the inerter, Smith (2002)."""

from core.effect import Effect, LogNormal, Parameter


def law(apparent_mass):
    return apparent_mass


EFFECT = Effect(
    title="Inerter",
    law=law,
    acts_on="inertance",
    linear=("apparent_mass",),
    parameters=(
        Parameter("apparent_mass", "kg", (0.0, 1e11), LogNormal(2e6, 1.5), "force over relative acceleration"),
    ),
    absent={"apparent_mass": 0.0},
    family="inertia",
    explanation="A rotating mass acts between slab and ground like a mass of {apparent_mass} against their relative "
    "acceleration.",
    suspect_when="The stiffness seems too low, by an amount that grows with the square of the frequency.",
    source="Smith (2002); Ikago, Saito & Inoue (2012): dampers with an apparent mass",
)
