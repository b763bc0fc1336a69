"""Offset that an earlier earthquake left and that the next one removes.

At rest the damper balances the force of the rubber. Once the damper yields, its share fades with the travel, and
the force of the rubber remains. For the hysteresis of Wen (1976) with n = 1 and β = 0 the decay is exactly exponential.
"""

from core.effect import Effect, LogNormal, Normal, Parameter


def law(v, released, held_force, travel):
    return held_force * released, abs(v) * (1.0 - released) / travel


EFFECT = Effect(
    title="Offset left by an earlier earthquake",
    law=law,
    states=("released",),
    linear=("held_force",),
    parameters=(
        Parameter("held_force", "N", (-1e10, 1e10), Normal(5e5, 2e6), "force of the rubber in that offset position"),
        Parameter("travel", "m", (1e-3, 0.5), LogNormal(5e-3, 1.0), "travel over which it fades"),
    ),
    absent={"held_force": 0.0},
    family="offset",
    explanation="The layer began off its centre, where the damper balanced {held_force} of the rubber; this fades "
    "within {travel} of travel.",
    suspect_when="The layer comes to rest at another position than where it began; the loop is shifted once the "
    "damper has yielded.",
    source="Katsaras, Panagiotakos & Kolias (2008): re-centring from an initial displacement",
)
