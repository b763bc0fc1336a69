"""Damping that grows with the square of the displacement, x² v: Tang & Brennan (2013)."""

from core.effect import Effect, LogNormal, Parameter


def law(u, v, c_2):
    return c_2 * u * u * v


EFFECT = Effect(
    title="Damping that grows with displacement",
    law=law,
    linear=("c_2",),
    parameters=(
        Parameter("c_2", "N s/m^3", (0.0, 1e15), LogNormal(5e8, 2.0), "damping coefficient by squared displacement"),
    ),
    absent={"c_2": 0.0},
    family="displacement-dependent damping",
    explanation="The damping coefficient grows with the displacement, by {c_2} u².",
    suspect_when="Large loops are wide at their shoulders, and small ones enclose almost no area.",
    source="Tang & Brennan (2013): damping by x² v against cubic damping",
)
