"""The layer was left off its centre, and centres itself in the next earthquake.

At rest the locked damper holds the force of the rubber; once it yields, that memory fades with the travel and the force
remains. For the hysteresis of Wen (1976) with n = 1 and β = 0 it fades exactly so, exponentially.
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
        Parameter("travel", "m", (1e-3, 0.5), LogNormal(5e-3, 1.0), "travel over which it is let go"),
    ),
    absent={"held_force": 0.0},
    family="offset",
    explanation="The layer stood off its centre, held against {held_force}, and was let go within {travel} of travel.",
    suspect_when="The layer comes to rest elsewhere than it began; the loop is shifted once it has yielded.",
    source="Katsaras, Panagiotakos & Kolias (2008): re-centring from an initial displacement",
)
