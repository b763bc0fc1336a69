"""Elastic force that depends on the share of the earthquake's largest displacement: Kikuchi & Aiken (1997).

Their force is a sum of a linear one and one of a power of u / u_max. Here it is a polynomial of that share, so that
loops of every size are alike.
"""

from math import copysign

from core.effect import Effect, Normal, Parameter

CATCHING_UP = 2.5e-3
"""s: short compared with any motion, long enough for steps of a few milliseconds."""
REST = 1e-6
"""m: below it the layer has not moved."""


def law(u, v, extreme, softening, k_2, k_3):
    outwards = v * copysign(1.0, u)
    share = min(abs(u) / max(extreme, REST), 1.0)
    return softening * (k_2 + k_3 * share) * share * u, max(outwards + (abs(u) - extreme) / CATCHING_UP, 0.0)


EFFECT = Effect(
    title="Shape of the loop",
    law=law,
    kind="rubber",
    states=("extreme",),
    linear=("k_2", "k_3"),
    parameters=(
        Parameter("k_2", "N/m", (-1e12, 1e12), Normal(-1e7, 1e8), "stiffness in proportion to the share"),
        Parameter("k_3", "N/m", (-1e12, 1e12), Normal(4e7, 1e8), "stiffness in proportion to its square"),
    ),
    absent={"k_2": 0.0, "k_3": 0.0},
    family="strain dependence",
    explanation="The stiffness changes within the loop: by {k_2} x + {k_3} x² where x is the displacement over the "
    "largest one of the earthquake so far.",
    suspect_when="Loops of every size have the same shape, softer or stiffer at their ends than in their middle.",
    source="Kikuchi & Aiken (1997): forces of rubber by u / u_max; the polynomial is an assumption",
)
