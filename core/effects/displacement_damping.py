"""Damping that grows with a power of the displacement, usually the square, x² v: Tang & Brennan (2013)."""

from core.effect import Effect, LogNormal, Normal, Parameter

REFERENCE = 0.1
"""m, displacement at which all powers have the same damping coefficient."""
REST = 1e-9
"""m: a smaller displacement counts as this before a power is taken."""


def law(u, v, c_2, power):
    grown = 1.0 if power == 2.0 else max(abs(u) / REFERENCE, REST / REFERENCE) ** (power - 2.0)
    return c_2 * u * u * grown * v


EFFECT = Effect(
    title="Damping that grows with displacement",
    law=law,
    linear=("c_2",),
    forms={"power": (1.0, 3.0)},
    parameters=(
        Parameter(
            "c_2",
            "N s/m^3",
            (0.0, 1e15),
            LogNormal(5e8, 2.0),
            "damping coefficient by squared displacement; with another power, that at 0.1 m",
        ),
        Parameter("power", "1", (0.3, 6.0), Normal(2.0, 0.7), "power of the displacement"),
    ),
    absent={"c_2": 0.0},
    family="displacement-dependent damping",
    explanation="The damping coefficient grows with the displacement, by {c_2} u².",
    suspect_when="Large loops are wide at their shoulders, and small ones enclose almost no area.",
    source="Tang & Brennan (2013): damping by x² v against cubic damping",
)
