"""Rubber that softens as a power of the largest displacement of the running earthquake, and has recovered by the next.

After Grant, Fenves and Whittaker (2004) and Abe, Yoshida and Fujino (2004), who distinguish this memory from the
lasting one (`lasting_softening`); the power instead of their functions describes the softening beyond the range that
was seen better.
"""

from math import copysign

from core.effect import Effect, LogNormal, Parameter

CATCHING_UP = 2.5e-3
"""s: short compared with any motion, long enough for steps of a few milliseconds."""


def law(u, v, largest, a, u_r, u_0):
    outwards = v * copysign(1.0, u)
    softer = ((largest + u_r) / (u_0 + u_r)) ** (-a)
    return softer, max(outwards + (abs(u) - largest) / CATCHING_UP, 0.0)


EFFECT = Effect(
    title="Softening by the earthquake's largest displacement",
    law=law,
    states=("largest",),
    acts_on="softening",
    held=("u_r", "u_0"),  # the stiffness has the same effect, but for small motion at the beginning
    parameters=(
        Parameter("a", "1", (0.0, 1.0), LogNormal(0.25, 0.7), "power by which the stiffness falls"),
        Parameter("u_r", "m", (1e-4, 0.1), LogNormal(4e-3, 0.7), "displacement up to which the rubber is as at rest"),
        Parameter("u_0", "m", (1e-3, 1.0), LogNormal(0.1, 0.7), "largest displacement at which stiffnesses are given"),
    ),
    absent={"a": 0.0},
    family="softening by past displacement",
    explanation="The rubber's stiffness falls as the power −{a:.2f} of the largest displacement that the earthquake "
    "has caused so far, and has recovered when the next one begins; stiffnesses are those after {u_0}.",
    suspect_when="Stiffness falls at every new largest displacement and stays low in smaller motion after it, and each "
    "earthquake begins as stiff as the one before.",
    source="Grant, Fenves & Whittaker (2004); Abe, Yoshida & Fujino (2004): two memories of high-damping rubber; the "
    "power is an assumption",
)
