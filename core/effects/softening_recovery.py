"""Rubber that recovers some of its stiffness within seconds, as smaller motion follows the largest.

The recent displacement is at least the present one and fades with time. The rubber recovers as a power of its share of
the earthquake's largest one.
"""

from math import copysign

from core.effect import Effect, LogNormal, Parameter

CATCHING_UP = 5e-3
"""s: short compared with any motion; with half of it derivatives would be unstable in steps of 10 ms, since the recent
displacement often follows the present one."""


def law(u, v, reached, recent, d, t_f, u_r):
    outwards = v * copysign(1.0, u)
    stiffer = ((reached + u_r) / (max(recent, 0.0) + u_r)) ** d
    return (
        stiffer,
        max(outwards + (abs(u) - reached) / CATCHING_UP, 0.0),
        max(outwards + (abs(u) - recent) / CATCHING_UP, -recent / t_f),
    )


EFFECT = Effect(
    title="Recovery of softened rubber",
    law=law,
    states=("reached", "recent"),
    acts_on="softening",
    held=("u_r",),  # smaller motion shows little of the rubber's stiffness
    parameters=(
        Parameter("d", "1", (0.0, 1.0), LogNormal(0.15, 0.7), "power of the recovery"),
        Parameter("t_f", "s", (0.1, 100.0), LogNormal(4.0, 0.7), "time in which the recent displacement fades"),
        Parameter("u_r", "m", (1e-4, 0.1), LogNormal(4e-3, 0.7), "displacement below which nothing fades further"),
    ),
    absent={"d": 0.0},
    family="softening by past displacement",
    explanation="In motion that is smaller than before, the rubber recovers stiffness within {t_f}, as the power "
    "{d:.2f} of the largest displacement over the recent one.",
    suspect_when="Small motion some seconds after the largest is stiffer than small motion right after it.",
    source="Mullins (1969): softened rubber recovers in part; the law is an assumption",
)
