"""Steel that yields in parallel with the damper: Menegotto & Pinto (1973), its roundness after Filippou et al. (1983).

From each reversal one curve leads to the yield force on the other side. It becomes rounder as the plastic excursion
grows, so that the first yield is sharp and later loops are round. Hardening is left to `elastic`: the published curve
with hardening is this one in parallel with a spring. The points of reversal are states that catch up within
CATCHING_UP.
"""

from core.effect import Effect, LogNormal, Parameter

CATCHING_UP = 2.5e-3
"""s: short compared with any motion, long enough for steps of a few milliseconds."""
SHORTEST = 0.38
"""Share of an integration step: the force comes to its bound no faster than within this; see `friction`."""
ROUNDED, SOON = 0.925, 0.15
"""c_R1 and c_R2: share of the roundness' exponent that plastic excursions take away, and at how many yield
displacements they have taken half of it (Filippou, Popov & Bertero 1983: 18.5 of 20, and 0.15)."""
NARROWEST = 1e-3
"""Smallest way from a reversal to the bound, over the yield force."""


def law(u, v, step, z_m, low, u_low, high, u_high, top, bottom, F_m, D_m, R_0):
    rising = v >= 0.0
    z = z_m if rising else -z_m
    start = low if rising else -high
    begun = u_low if rising else -u_high
    extreme = max(top if rising else -bottom, D_m)
    way = max(1.0 - start, NARROWEST)
    excursion = abs(extreme - begun - way * D_m) / D_m
    R = R_0 * (1.0 - ROUNDED * excursion / (SOON + excursion))
    done = min(max((z - start) / way, 0.0), 1.0)
    slope = (1.0 - (done**R if done > 0.0 else 0.0)) ** (1.0 + 1.0 / R)
    rate = min(abs(v) / D_m * slope, (1.0 - z) / (SHORTEST * step))
    follow_low = 0.0 if rising else 1.0 / CATCHING_UP
    follow_high = 1.0 / CATCHING_UP if rising else 0.0
    return (
        F_m * z_m,
        rate if rising else -rate,
        (z_m - low) * follow_low,
        (u - u_low) * follow_low,
        (z_m - high) * follow_high,
        (u - u_high) * follow_high,
        max(u_high - top, 0.0) * follow_low,
        min(u_low - bottom, 0.0) * follow_high,
    )


EFFECT = Effect(
    title="Steel in parallel, rounder after it has yielded",
    law=law,
    kind="yielding",
    states=("z_m", "low", "u_low", "high", "u_high", "top", "bottom"),
    linear=("F_m",),
    open_ended=("R_0",),
    parameters=(
        Parameter("F_m", "N", (0.0, 1e10), LogNormal(1.5e6, 1.5), "yield force"),
        Parameter("D_m", "m", (5e-4, 0.5), LogNormal(1e-2, 1.0), "yield displacement"),
        Parameter("R_0", "1", (3.0, 60.0), LogNormal(18.0, 0.5), "sharpness of the first yield"),
    ),
    absent={"F_m": 0.0},
    family="parallel hysteresis",
    explanation="A steel damper yields at {F_m} after an elastic displacement of {D_m}: sharply at first, with an "
    "exponent of {R_0:.0f}, and roundly once it has yielded.",
    suspect_when="The first yield has a corner, and later loops are rounder the further the layer has yielded before.",
    source="Menegotto & Pinto (1973); Filippou, Popov & Bertero (1983), for the roundness",
)
