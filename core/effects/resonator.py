"""Oscillator driven by the motion of the slab relative to the ground: an inerter in series with a spring and a dashpot.

After Lazar, Neild and Wagg (2014). Its force is the inertance times its acceleration relative to the ground; the
ground's own acceleration does not act on it, as it does on a `tuned_mass`.
"""

from core.effect import Effect, LogNormal, Parameter

TURN = 6.283185307179586
"""rad."""


def law(u, v, place, speed, mass, frequency, damping):
    omega = TURN * frequency
    acceleration = omega * (omega * (u - place) + 2.0 * damping * (v - speed))
    return mass * acceleration, speed, acceleration


EFFECT = Effect(
    title="Hidden resonator",
    law=law,
    states=("place", "speed"),
    linear=("mass",),
    parameters=(
        Parameter("mass", "kg", (0.0, 1e10), LogNormal(5e5, 1.5), "oscillating mass"),
        Parameter("frequency", "Hz", (0.05, 30.0), LogNormal(1.5, 1.0), "its natural frequency"),
        Parameter("damping", "1", (1e-3, 1.0), LogNormal(0.05, 1.0), "its damping ratio"),
    ),
    absent={"mass": 0.0},
    family="inertia",
    explanation="A mass of {mass} oscillates at {frequency}, with a damping ratio of {damping:.3f}.",
    suspect_when="The residual keeps oscillating at one frequency, also after the strong motion.",
    source="Lazar, Neild & Wagg (2014): tuned inerter damper",
)
