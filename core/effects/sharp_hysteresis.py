"""Hysteresis of any sharpness in parallel with the damper's: Wen (1976) with β = γ = 1/2 and an exponent of its own.

With an exponent of 1 it is `second_hysteresis`; from about 10 on it has the corners of an elastic-plastic element
(Prandtl, 1928). Hardening of its own is left to `elastic`: a bilinear element is a spring in parallel with this one.
Unloading is straight, or steeper at first by a share of z^n: with 1 the law is that of Özdemir (1976).
"""

from core.effect import Effect, LogNormal, Normal, Parameter

SHORTEST = 0.38
"""Share of an integration step: the variable comes to its bound no faster than within this; see `friction`."""
AT_BOUND = 1e-3
"""1/s: where the variable nears its bound more slowly, rounding must not decide whether that is too fast."""


def law(v, step, z_p, F_p, D_p, n_p, unloading):
    shortest = SHORTEST * step
    along = z_p if v >= 0.0 else -z_p
    bend = along**n_p if along > 0.0 else (0.0 if unloading == 0.0 else -unloading * (-along) ** n_p)
    rate = abs(v) / D_p * (1.0 - bend)
    nearing = (1.0 - along) / shortest
    is_steep = n_p * abs(v) * shortest > D_p
    if abs(rate) > abs(nearing) or (is_steep and abs(nearing) < AT_BOUND):
        rate = nearing
    return F_p * z_p, rate if v >= 0.0 else -rate


EFFECT = Effect(
    title="Second hysteresis of any sharpness",
    law=law,
    kind="yielding",
    states=("z_p",),
    linear=("F_p",),
    forms={"unloading": (0.5, 1.0)},
    open_ended=("n_p",),
    special={"n_p": 1.0},
    parameters=(
        Parameter("F_p", "N", (0.0, 1e10), LogNormal(1.5e6, 1.5), "yield force"),
        Parameter("D_p", "m", (5e-4, 0.5), LogNormal(1e-2, 1.0), "yield displacement"),
        Parameter("n_p", "1", (1.0, 100.0), LogNormal(3.0, 1.0), "sharpness: 2 is round, from 10 on it has corners"),
        Parameter("unloading", "1", (-0.9, 2.0), Normal(0.0, 0.5), "share by which unloading begins steeper"),
    ),
    absent={"F_p": 0.0},
    family="parallel hysteresis",
    explanation="A second damper, as of steel, yields at {F_p} after an elastic displacement of {D_p}, with a "
    "sharpness of {n_p:.1f}.",
    suspect_when="The sides of the loop are straight, and its stiffness falls over a short distance where a damper "
    "yields.",
    source="Wen (1976), eqs 2-3; Prandtl (1928) for a large exponent; in parallel as Iwan (1966); Özdemir (1976)",
)
