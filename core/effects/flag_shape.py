"""Flag-shaped loop with corners: elastic up to the activation, as Christopoulos, Filiatrault & Folz (2002) draw it.

Beyond the opening the force is the activation on loading and a lower one on unloading; between the two it follows the
elastic slope. Below the lower force loading and unloading share one line. `self_centring` has a round loop, whose
closing force is lower from the origin on. A stiffness after opening is a spring in parallel.
"""

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 2e-3
"""s: the force comes to its bound no faster than this, since steps of a few milliseconds could not follow it."""
NARROWEST = 1e-3
"""Smallest half distance of the two forces over the activation."""


def law(u, v, w, activation, lost, opening):
    opened = max(-1.0, min(1.0, u / opening))
    closing = max(lost - 1.0, min(1.0 - lost, opened))
    middle, half = 0.5 * (opened + closing), 0.5 * abs(opened - closing)
    if abs(u) >= opening:
        along_elastic = 1.0
    elif abs(u) > opening * (1.0 - lost):
        along_elastic = 0.5 - 0.5 * (w if u > 0.0 else -w)
    else:
        along_elastic = 0.0
    towards = w if v >= 0.0 else -w
    rate = min(abs(v) / (opening * max(half, NARROWEST)) * along_elastic, (1.0 - towards) / SHORTEST)
    return activation * (middle + half * w), rate if v >= 0.0 else -rate


EFFECT = Effect(
    title="Self-centring device with corners (flag shape)",
    law=law,
    states=("w",),
    linear=("activation",),
    parameters=(
        Parameter("activation", "N", (0.0, 1e10), LogNormal(2e6, 1.5), "force at which it opens"),
        Parameter("lost", "1", (1e-3, 1.0), LogNormal(0.6, 0.5), "share of that force that is missing when it closes"),
        Parameter("opening", "m", (1e-3, 0.2), LogNormal(5e-3, 0.8), "displacement at which it opens"),
    ),
    absent={"activation": 0.0},
    family="self-centring",
    explanation="A device is elastic up to {activation} at {opening}, opens there, closes at a force lower by a share "
    "of {lost:.2f}, and returns to zero.",
    suspect_when="Loops are straight lines with corners, enclose area away from zero displacement and none at it, and "
    "the layer comes to rest where it began.",
    source="Christopoulos, Filiatrault & Folz (2002): flag-shaped hysteresis",
)
