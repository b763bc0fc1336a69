"""Flag-shaped loop of a device that opens under load and closes at zero: Christopoulos, Filiatrault & Folz (2002).

The friction is proportional to the clamping force that is overcome, so that no force is left at zero displacement.
"""

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 2e-3
"""s: a slip faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""


def law(u, v, z_s, activation, lost, opening):
    open_ = max(-1.0, min(1.0, u / opening))
    rate = (v - 0.5 * (abs(v) * z_s + v * abs(z_s))) / max(opening, SHORTEST * abs(v))
    return activation * ((1.0 - 0.5 * lost) * open_ + 0.5 * lost * abs(open_) * z_s), rate


EFFECT = Effect(
    title="Self-centring device (flag shape)",
    law=law,
    states=("z_s",),
    linear=("activation",),
    parameters=(
        Parameter("activation", "N", (0.0, 1e10), LogNormal(2e6, 1.5), "force at which it opens"),
        Parameter("lost", "1", (1e-3, 1.0), LogNormal(0.6, 0.5), "share of that force that is missing when it closes"),
        Parameter("opening", "m", (1e-3, 0.2), LogNormal(5e-3, 0.8), "displacement over which it opens"),
    ),
    absent={"activation": 0.0},
    family="self-centring",
    explanation="A device opens at {activation} (over {opening}), closes at a force lower by a share of {lost:.2f}, "
    "and returns to zero.",
    suspect_when="Loops enclose area away from zero displacement and none at it, and the layer comes to rest where it "
    "began.",
    source="Christopoulos, Filiatrault & Folz (2002): flag-shaped hysteresis, energy dissipation factor",
)
