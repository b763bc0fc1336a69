"""Hysteresis of filled rubber at every amplitude: four elements of Dahl (1968) in parallel, as Iwan (1966) distributes
yield.

The displacements over which the elements develop have equal ratios, and their strengths follow a power of these. One
such element is that of `second_hysteresis`. The shortest is stiff: it goes to its end within a millimetre, and faster
than SHORTEST only where it is there already.
"""

from core.effect import Effect, LogNormal, Normal, Parameter

RATIO = 100 ** (1 / 3)
"""Ratio of the displacements of neighbouring elements: four elements over two decades."""
MIDDLE = 30.0
"""Displacement of an element that would have the strength F_s, over that of the first element."""
SHORTEST = 2e-3
"""s: a yield faster than this is slowed down to it, since steps of a few milliseconds cannot follow it."""


def law(v, z_1, z_2, z_3, z_4, growth, relaxing, F_s, s, D):
    speed, drive = abs(v), growth * v
    widening = RATIO ** (1.0 - s)
    force = z_1 + widening * (z_2 + widening * (z_3 + widening * z_4))
    return (
        F_s * MIDDLE ** (s - 1.0) * force,
        (drive - z_1 * speed) / max(D, SHORTEST * speed) - relaxing * z_1,
        (drive - z_2 * speed) / max(RATIO * D, SHORTEST * speed) - relaxing * z_2,
        (drive - z_3 * speed) / (RATIO * RATIO * D) - relaxing * z_3,
        (drive - z_4 * speed) / (RATIO * RATIO * RATIO * D) - relaxing * z_4,
    )


EFFECT = Effect(
    title="Hysteresis at every amplitude",
    law=law,
    kind="rubber",
    states=("z_1", "z_2", "z_3", "z_4"),
    linear=("F_s",),
    held=("D",),  # below it the motion of strong earthquakes shows nothing
    parameters=(
        Parameter("F_s", "N", (0.0, 1e10), LogNormal(1e6, 1.5), "strength of an element that develops over 30 D"),
        Parameter(
            "s", "1", (-1.0, 2.0), Normal(0.6, 0.3), "1 less the power of displacement by which the strengths rise"
        ),
        Parameter("D", "m", (1e-4, 1e-2), LogNormal(1e-3, 0.7), "displacement over which the first element develops"),
    ),
    absent={"F_s": 0.0},
    family="parallel hysteresis",
    explanation="The rubber has hysteresis at every amplitude: elements that develop over {D} and over 4.6, 22 and 100 "
    "times as much, whose strengths follow the power 1 − {s:.2f} of these displacements; it is {F_s} at 30 times.",
    suspect_when="Loops of every size are wide and pointed at their ends, and no yield displacement fits all of them.",
    source="Dahl (1968); Iwan (1966): elements in parallel; the power law is an assumption",
)
