"""A device whose force follows the relative acceleration of its ends: the inerter, Smith (2002)."""

from core.effect import Effect, LogNormal, Parameter


def law(apparent_mass):
    return apparent_mass


EFFECT = Effect(
    title="Inerter",
    law=law,
    acts_on="inertance",
    linear=("apparent_mass",),
    parameters=(Parameter("apparent_mass", "kg", (0.0, 1e11), LogNormal(2e6, 1.5), "force by relative acceleration"),),
    absent={"apparent_mass": 0.0},
    family="inertia",
    explanation="A rotating mass resists the layer's acceleration like {apparent_mass} between slab and ground.",
    suspect_when="The force seems to lack stiffness in proportion to the square of the frequency.",
    source="Smith (2002); Ikago, Saito & Inoue (2012): dampers with an apparent mass",
)
