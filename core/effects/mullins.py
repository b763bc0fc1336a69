"""Scragging: rubber is stiffer until it has been strained once. Mullins (1969); Ogden & Roxburgh (1999).

The largest past displacement is a state of the layer, zero before the first record. It grows with the motion that
exceeds it; what a step has missed is made up within CATCHING_UP.
"""

from math import copysign, exp

from core.effect import Effect, LogNormal, Parameter

CATCHING_UP = 2.5e-3
"""s: short compared with any motion, long enough for steps of a few milliseconds."""


def law(u, v, largest, k_M, u_M):
    outwards = v * copysign(1.0, u)
    return k_M * exp(-largest / u_M) * u, max(outwards + (abs(u) - largest) / CATCHING_UP, 0.0)


EFFECT = Effect(
    title="Mullins effect (scragging)",
    law=law,
    kind="rubber",
    states=("largest",),
    carried=("largest",),
    linear=("k_M",),
    parameters=(
        Parameter("k_M", "N/m", (0.0, 1e12), LogNormal(1e8, 1.5), "stiffness of virgin rubber that strain removes"),
        Parameter("u_M", "m", (1e-3, 1.0), LogNormal(2.5e-2, 1.0), "displacement after which 1/e of it is left"),
    ),
    absent={"k_M": 0.0},
    family="softening with use",
    explanation="Virgin rubber is stiffer by {k_M}, and loses this permanently after displacements of about {u_M}.",
    suspect_when="Small motions are stiffer before the largest motion than after it, and the stiffness does not "
    "recover.",
    source="Mullins (1969); Ogden & Roxburgh (1999): softening by the largest past deformation",
)
