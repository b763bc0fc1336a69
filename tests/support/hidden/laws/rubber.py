"""Hidden laws of high-damping rubber: hysteresis of every size, softening by what it went through, growth, relaxation.

Powers, lengths and times are drawn around those that fit a building on such bearings on a shaking table.
"""

import math

from numba import njit

from hidden.law import Law
from hidden.laws.layer import z_after_travel
from hidden.laws.rubbing import dahl

LONGEST = 0.05
"""Longest piece of a travel that is integrated at once, in yield displacements."""


def spectrum(p, s, s1, step, past):
    """Iwan (1966) of slips by Dahl, each exact: lengths of equal ratios over two decades, strengths of their power.

    `force` is the sum of the strengths. States: slips.
    """
    force, total = 0.0, 0.0
    for j in range(4):
        decades = 2.0 * j / 3.0
        strength = 10.0 ** (decades * p[1])
        s1[j] = dahl(s[j], (step.u - step.u0) / (p[2] * 10.0**decades))
        force += strength * s1[j]
        total += strength
    return p[0] * force / total


def scragged(p, s, s1, step, past):
    """Stiffness p[3] at a largest displacement p[2], less the farther the layer went, as a power of it.

    State: logarithm of the farthest, over the displacement p[1] below which nothing softens.
    """
    s1[0] = max(s[0], math.log1p(abs(step.u) / p[1]))
    return p[3] * math.expm1(p[0] * (math.log1p(p[2] / p[1]) - s1[0])) * step.u


def recovering(p, s, s1, step, past):
    """Stiffness p[3] that comes back as a power of the farthest over the recent displacement.

    States: the farthest, as its logarithm; the recent one, in m, which fades within p[1] down to the present one.
    """
    s1[0] = max(s[0], math.log1p(abs(step.u) / p[2]))
    s1[1] = max(s[1] * math.exp(-step.h / p[1]), abs(step.u))
    return p[3] * math.expm1(p[0] * (s1[0] - math.log1p(s1[1] / p[2]))) * step.u


def shaped(p, s, s1, step, past):
    """Kikuchi and Aiken (1997): stiffness by u over the farthest, which is the state.

    The share `squared` of it goes with the square; beyond one the rest is negative, and softens.
    """
    s1[0] = max(s[0], abs(step.u))
    x = abs(step.u) / s1[0] if s1[0] > 0 else 0.0
    return p[0] * ((1.0 - p[1]) * x + p[1] * x * x) * step.u


@njit
def bound(u, p):
    """Limit of z: the damper's share more with the square of the displacement, at p[4]."""
    return 1.0 + p[3] * (u / p[4]) ** 2


def growing(p, s, s1, step, past):
    """The damper under a limit that rises: over a short piece the usual yielding of z as a share of its limit."""
    travel = (step.u - step.u0) / p[1]
    pieces = 1 + int(abs(travel) / LONGEST)
    z = s[0]
    for piece in range(pieces):
        limit = bound(step.u0 + (step.u - step.u0) * (piece + 0.5) / pieces, p)
        z = limit * z_after_travel(z / limit, travel / pieces, p[2])
    s1[0] = z
    return p[0] * z


def relaxing(p, s, s1, step, past):
    """The damper, and in turns with its travel the loss of its force in time (Strang, 1968)."""
    kept = math.exp(-0.5 * p[3] * step.h)
    s1[0] = kept * z_after_travel(kept * s[0], (step.u - step.u0) / p[1], p[2])
    return p[0] * s1[0]


def _damper(layer):
    return {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta}


LAWS = (
    Law(
        "hysteresis_spectrum",
        "hysteresis_spectrum",
        "same",
        spectrum,
        lambda layer, rng: {
            "force": layer.peak_force * 0.1,
            "power": rng.uniform(0.1, 0.7),
            "length": 10 ** rng.uniform(-3.1, -2.9),
        },
        ("force",),
        states=4,
    ),
    *(
        Law(
            name,
            name,
            "same",
            scragged,
            lambda layer, rng: {
                "power": rng.uniform(0.08, 0.4),
                "rest": 10 ** rng.uniform(-2.7, -2.1),
                "given": layer.peak,
                "k": layer.k,
            },
            ("power",),
            states=1,
            carried=carried,
            limits={"power": 0.8},
        )
        for name, carried in (("recent_softening", ()), ("lasting_softening", (0,)))
    ),
    Law(
        "softening_recovery",
        "softening_recovery",
        "same",
        recovering,
        lambda layer, rng: {
            "power": rng.uniform(0.08, 0.3),
            "fades": rng.uniform(2.0, 8.0),
            "rest": 10 ** rng.uniform(-2.7, -2.1),
            "k": layer.k,
        },
        ("power",),
        states=2,
        limits={"power": 0.8},
    ),
    Law(
        "loop_shape",
        "loop_shape",
        "same",
        shaped,
        lambda layer, rng: {"stiffness": layer.k * 0.2, "squared": rng.uniform(0.0, 2.0)},
        ("stiffness",),
        states=1,
    ),
    Law(
        "strength_growth",
        "strength_growth",
        "same",
        growing,
        lambda layer, rng: _damper(layer) | {"growth": 10 ** rng.uniform(-0.7, 0.3), "at": layer.peak},
        ("growth",),
        states=1,
        limits={"growth": 10.0},
        kind="yielding",
    ),
    Law(
        "stress_relaxation",
        "stress_relaxation",
        "same",
        relaxing,
        lambda layer, rng: _damper(layer) | {"rate": 10 ** rng.uniform(-0.3, 1.0)},
        ("rate",),
        states=1,
        limits={"rate": 40.0},
        kind="yielding",
    ),
)
