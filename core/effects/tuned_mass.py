"""Mass on its own spring on the base slab, such as a tuned mass damper or a tank: den Hartog (1956).

It is not among the masses of the building file. The ground's acceleration acts on it, as on every mass; `resonator` is
an oscillator on which it does not act, such as an inerter in series with a spring.
"""

from core.effect import Effect, LogNormal, Parameter

TURN = 6.283185307179586
"""rad."""


def law(u, v, ground, place, speed, mass, frequency, damping):
    omega = TURN * frequency
    pulled = omega * (omega * (u - place) + 2.0 * damping * (v - speed))
    return mass * pulled, speed, pulled - ground


EFFECT = Effect(
    title="Mass on its own spring on the base slab",
    law=law,
    states=("place", "speed"),
    linear=("mass",),
    parameters=(
        Parameter("mass", "kg", (0.0, 1e10), LogNormal(5e5, 1.5), "mass on the spring"),
        Parameter("frequency", "Hz", (0.05, 30.0), LogNormal(1.5, 1.0), "its natural frequency, the slab at rest"),
        Parameter("damping", "1", (1e-3, 1.0), LogNormal(0.05, 1.0), "its damping ratio"),
    ),
    absent={"mass": 0.0},
    family="inertia",
    explanation="A mass of {mass} on the base slab oscillates at {frequency}, with a damping ratio of {damping:.3f}.",
    suspect_when="The residual keeps oscillating at one frequency, also after the strong motion, and a mass on the "
    "slab is missing in the building file.",
    source="den Hartog (1956): dynamic vibration absorber",
)
