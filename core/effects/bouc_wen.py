"""Smooth hysteresis of a yielding damper: Bouc (1967), Wen (1976), as the paper writes it in eq 22.

The paper's γ and β are exchanged in Wen's own papers and in OpenSees.
"""

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 2e-3
"""s: a yield faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""
TINY = 1e-9
"""A smaller |z| counts as this before a power is taken, which is infinite at zero for n < 1."""


def law(v, z, sharpness, slope, plasticity, flow, cross_flow, growth, relaxing, F_y, D_y, A, beta, gamma, n):
    exponent = n * sharpness
    # a power in a compiled loop takes ten times as long
    bend = 1.0 if exponent == 1.0 else max(abs(z), TINY) ** (exponent - 1.0)
    plastic = plasticity * (bend * (z * (gamma * abs(v)) + abs(z) * (beta * v)) + z * cross_flow)
    reach = max(D_y, SHORTEST * plasticity * (exponent * abs(v) + cross_flow))
    return F_y * z, flow * (growth * slope * A * v - plastic) / reach - relaxing * z


def yield_force(F_y, A, beta, gamma, n):
    """Yield force, N: F_y at the limit of the hysteretic variable, z = (A / (β + γ))^(1/n)."""
    return F_y * (A / (beta + gamma)) ** (1 / n)


def yield_displacement(D_y, A, beta, gamma, n):
    """Yield displacement, m, at which the initial slope A / D_y reaches that limit."""
    return D_y / A * (A / (beta + gamma)) ** (1 / n)


EFFECT = Effect(
    title="Bouc-Wen hysteresis",
    law=law,
    kind="yielding",
    states=("z",),
    publishes="z",
    linear=("F_y",),
    design={"F_y": yield_force, "D_y": yield_displacement},
    held=("A", "gamma", "n"),  # the scale of z, and the exponent that `yield_sharpness` varies
    parameters=(
        Parameter("F_y", "N", (0.0, 1e10), LogNormal(1e6, 2.0), "yield force"),
        Parameter("D_y", "m", (1e-5, 0.5), LogNormal(3e-3, 1.0), "yield displacement"),
        Parameter("A", "1", (0.1, 10.0), LogNormal(1.0, 0.3), "initial slope of z against u / D_y"),
        Parameter("beta", "1", (0.0, 10.0), LogNormal(0.5, 0.5), "softening, on loading and unloading alike"),
        Parameter("gamma", "1", (0.0, 10.0), LogNormal(0.5, 0.5), "softening on loading, stiffening on unloading"),
        Parameter("n", "1", (0.5, 20.0), LogNormal(1.0, 0.5), "sharpness of the yield"),
    ),
    absent={"F_y": 0.0},
    family="hysteresis",
    explanation="The damper yields at {F_y}, at a displacement of about {D_y}, and dissipates energy at any speed.",
    suspect_when="The area of the loop does not depend on the speed, and the loop softens as the amplitude grows.",
    source="Wen (1976), eqs 2-3; the paper, eq 22",
)
