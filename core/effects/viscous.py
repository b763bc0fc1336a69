"""Linear viscous damping c_b x_b' (paper, eq 9)."""

from core.effect import Effect, LogNormal, Parameter


def law(v, c_b):
    return c_b * v


def damping_coefficient(c_b):
    return c_b


EFFECT = Effect(
    title="Viscous damping",
    law=law,
    parameters=(Parameter("c_b", "N s/m", (0.0, 1e11), LogNormal(1e6, 2.0), "viscous damping coefficient"),),
    absent={"c_b": 0.0},
    linear=("c_b",),
    design={"c_b": damping_coefficient},
    family="viscosity",
    explanation="Viscous damping with a coefficient of {c_b} opposes the motion.",
    suspect_when="The loop is an ellipse that becomes wider as the motion becomes faster.",
    source="the paper, eq 9",
)
