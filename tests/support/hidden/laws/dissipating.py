"""Hidden friction, second hysteresis and viscous laws."""

import math

from numba import njit

from hidden.law import Law


@njit
def slid(z, travel):
    """Dahl's elastic slip (1968) after a travel in slip lengths: dz/dξ = 1 − z in the direction of travel."""
    sign = 1.0 if travel >= 0 else -1.0
    return sign + (z - sign) * math.exp(-abs(travel))


def friction(p, s, s1, step, past):
    """Constantinou, Mokha and Reinhorn (1990): slow sliding has less of it, and it bites over an elastic length."""
    fast, lost, sharp, length = p[0], p[1], p[2], p[3]
    s1[0] = slid(s[0], (step.u - step.u0) / length)
    return fast * (1.0 - lost * math.exp(-sharp * abs(step.v))) * s1[0]


def regularised_friction(p, s, s1, step, past):
    return p[0] * math.tanh(step.v / p[1])


def lugre_friction(p, s, s1, step, past):
    """Canudas de Wit et al. (1995), its bristles exact over a step of constant velocity and level."""
    sliding, sticking, slow, length = p[0], p[1], p[2], p[3]
    level = 1.0 + (sticking - 1.0) * math.exp(-((step.v / slow) ** 2))
    travel = step.u - step.u0
    sign = 1.0 if travel >= 0 else -1.0
    s1[0] = sign * level + (s[0] - sign * level) * math.exp(-abs(travel) / (length * level))
    return sliding * s1[0]


def second_hysteresis(p, s, s1, step, past):
    travel = (step.u - step.u0) / p[1]
    sign = 1.0 if travel >= 0 else -1.0
    left, w = abs(travel), s[0] * sign
    if w < 0:  # unloading is straight
        w, left = min(w + left, 0.0), max(left + w, 0.0)
    s1[0] = sign * (1.0 - (1.0 - w) * math.exp(-left)) if w >= 0 else sign * w
    return p[0] * s1[0]


def power_viscous(p, s, s1, step, past):
    """`force` at 0.1 m/s."""
    return math.copysign(p[0] * (abs(step.v) / 0.1) ** p[1], step.v)


FRICTION = Law(
    "friction",
    "friction",
    "same",
    friction,
    lambda layer, rng: {
        "fast": layer.peak_force * 0.03,
        "lost": rng.uniform(0.1, 0.7),
        "sharp": 10 ** rng.uniform(0.7, 2.0),
        "length": 10 ** rng.uniform(-4.0, -2.6),
    },
    ("fast",),
    states=1,
)
SECOND_HYSTERESIS = Law(
    "second_hysteresis",
    "second_hysteresis",
    "same",
    second_hysteresis,
    lambda layer, rng: {"force": layer.peak_force * 0.08, "length": 10 ** rng.uniform(-2.2, -1.1)},
    ("force",),
    states=1,
)
POWER_VISCOUS = Law(
    "power_viscous",
    "power_viscous",
    "same",
    power_viscous,
    lambda layer, rng: {
        "force": layer.peak_force * 0.05,
        "exponent": float(rng.choice([rng.uniform(0.15, 0.7), rng.uniform(1.5, 2.6)])),
    },
    ("force",),
)
LAWS = (FRICTION, SECOND_HYSTERESIS, POWER_VISCOUS)
