"""Hidden laws of the displacement alone, and what changes the rubber's stiffness."""

import math

from numba import njit

from hidden.law import Law

DAY = 86400.0
"""s."""


@njit
def softplus(x):
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))


def hardening(p, s, s1, step, past):
    """`force` at `at`, of which the share `fifth` goes with the fifth power and the rest with the third."""
    x = step.u / p[1]
    return p[0] * x**3 * (1.0 - p[2] + p[2] * x * x)


def sinh_hardening(p, s, s1, step, past):
    x = step.u / p[1]
    return p[0] * (math.sinh(x) - x)


def tangent_hardening(p, s, s1, step, past):
    """Rubber that locks at the displacement `locked`, its slope bounded at 98 % of it."""
    x = max(-0.98, min(0.98, step.u / p[1])) * 0.5 * math.pi
    return p[0] * (math.tan(x) - x)


def moat(p, s, s1, step, past):
    wall, gap, back = p[0], p[1], p[2]
    return wall * (max(step.u - gap, 0.0) + min(step.u + back, 0.0))


def smooth_moat(p, s, s1, step, past):
    """A gap spring whose contact comes softly over the width p[2]: a softplus on each side."""
    ahead, behind = (step.u - p[1]) / p[2], (-step.u - p[1]) / p[2]
    return p[0] * p[2] * (softplus(ahead) - softplus(behind))


def hertz_moat(p, s, s1, step, past):
    """Hertz contact with damping (Muthukumar and DesRoches, 2006): K δ^1.5 (1 + D δ'), never pulling.

    `wall` is the force at a penetration of 10 mm.
    """
    ahead, behind = max(step.u - p[1], 0.0) / 0.01, max(-step.u - p[1], 0.0) / 0.01
    approach = step.v if step.u > 0 else -step.v
    return p[0] * max(1.0 + p[2] * approach, 0.0) * (ahead**1.5 - behind**1.5)


def asymmetry(p, s, s1, step, past):
    x = step.u / p[1]
    return p[0] * ((1.0 - p[2]) * abs(x) + p[2] * x * x)


def one_sided(p, s, s1, step, past):
    return p[0] * max(step.u, 0.0)


def strain_softening(p, s, s1, step, past):
    """Payne (1962): stiffness and damping that a strain takes away by half at p[2]."""
    return (p[0] * step.u + p[1] * step.v) / (1.0 + abs(step.u) / p[2])


def exponential_softening(p, s, s1, step, past):
    return (p[0] * step.u + p[1] * step.v) * math.exp(-abs(step.u) / p[2])


def temperature_stiffness(p, s, s1, step, past):
    """Force of a stiffness p[1] at 20 °C."""
    return p[1] * (math.exp(p[0] * (20.0 - step.temperature)) - 1.0) * step.u


def temperature_stiffness_straight(p, s, s1, step, past):
    return p[1] * p[0] * (20.0 - step.temperature) * step.u


def stiffness_step(p, s, s1, step, past):
    """Force of a stiffness p[2], lost within about two seconds of a date."""
    return -p[0] * p[2] * 0.5 * (1.0 + math.tanh((step.time - p[1]) / 2.0)) * step.u


def stiffness_break(p, s, s1, step, past):
    """Force of a stiffness p[2], lost within about a second after the layer exceeds p[1]. State: s since then."""
    s1[0] = s[0] + step.h if s[0] > 0 or abs(step.u) > p[1] else 0.0
    return -p[0] * p[2] * math.tanh(s1[0] / 0.5) * step.u


def stiffness_decay(p, s, s1, step, past):
    """Force of a stiffness p[2], lost over about a week from a date."""
    return -p[0] * p[2] * (1.0 - math.exp(-max(step.time - p[1], 0.0) / 6e5)) * step.u


def offset(p, s, s1, step, past):
    """A force that is there once the layer has travelled. State: how much of it."""
    s1[0] = 1.0 - (1.0 - s[0]) * math.exp(-abs(step.u - step.u0) / p[1])
    return p[0] * s1[0]


LAWS = (
    Law(
        "hardening",
        "hardening",
        "same",
        hardening,
        lambda layer, rng: {"force": layer.peak_force * 0.1, "at": layer.peak, "fifth": rng.uniform(0.0, 1.0)},
        ("force",),
    ),
    Law(
        "hardening_sinh",
        "hardening",
        "another",
        sinh_hardening,
        lambda layer, rng: {"force": layer.peak_force * 0.05, "at": layer.peak * rng.uniform(0.3, 0.6)},
        ("force",),
    ),
    Law(
        "hardening_tangent",
        "hardening",
        "another",
        tangent_hardening,
        lambda layer, rng: {"force": layer.peak_force * 0.05, "locked": layer.peak * rng.uniform(1.2, 1.6)},
        ("force",),
    ),
    Law(
        "moat",
        "moat",
        "same",
        moat,
        lambda layer, rng: (
            {"wall": layer.k * 2.0, "gap": layer.peak * (gap := rng.uniform(0.4, 0.9))}
            | {"back": layer.peak * gap * rng.uniform(0.9, 1.1)}
        ),
        ("wall",),
    ),
    Law(
        "moat_smooth",
        "moat",
        "another",
        smooth_moat,
        lambda layer, rng: {
            "wall": layer.k * 2.0,
            "gap": layer.peak * rng.uniform(0.4, 0.85),
            "width": layer.peak * rng.uniform(0.02, 0.06),
        },
        ("wall",),
    ),
    Law(
        "moat_hertz",
        "moat",
        "another",
        hertz_moat,
        lambda layer, rng: {
            "wall": layer.peak_force * 0.2,
            "gap": layer.peak * rng.uniform(0.4, 0.85),
            "damping": rng.uniform(0.3, 2.0),
        },
        ("wall",),
    ),
    Law(
        "asymmetry",
        "asymmetry",
        "same",
        asymmetry,
        lambda layer, rng: {"force": layer.peak_force * 0.1, "at": layer.peak, "squared": rng.uniform(0.0, 1.0)},
        ("force",),
    ),
    Law(
        "asymmetry_one_sided",
        "asymmetry",
        "another",
        one_sided,
        lambda layer, rng: {"stiffness": layer.k * 0.2},
        ("stiffness",),
    ),
    *(
        Law(
            name,
            "strain_softening",
            "same" if advance is strain_softening else "another",
            advance,
            lambda layer, rng: {
                "stiffness": layer.k * rng.uniform(0.2, 0.6),
                "damping": layer.c * rng.uniform(0.0, 1.0),
                "strain": layer.peak * 10 ** rng.uniform(-1.2, -0.3),
            },
            ("stiffness", "damping"),
        )
        for name, advance in (
            ("strain_softening", strain_softening),
            ("strain_softening_exponential", exponential_softening),
        )
    ),
    *(
        Law(
            name,
            "temperature_stiffness",
            "same" if advance is temperature_stiffness else "another",
            advance,
            lambda layer, rng: {"share": 0.01, "k": layer.k},
            ("share",),
            limits={"share": 0.03},
            needs=("temperature",),
        )
        for name, advance in (
            ("temperature_stiffness", temperature_stiffness),
            ("temperature_stiffness_straight", temperature_stiffness_straight),
        )
    ),
    Law(
        "stiffness_step",
        "stiffness_step",
        "same",
        stiffness_step,
        lambda layer, rng: {"lost": 0.15, "date": rng.uniform(25 * DAY, 115 * DAY), "k": layer.k},
        ("lost",),
        limits={"lost": 0.6},
    ),
    Law(
        "stiffness_step_break",
        "stiffness_step",
        "another",
        stiffness_break,
        lambda layer, rng: {"lost": 0.15, "beyond": layer.peak * rng.uniform(0.5, 0.9), "k": layer.k},
        ("lost",),
        states=1,
        carried=(0,),
        limits={"lost": 0.6},
    ),
    Law(
        "stiffness_step_decay",
        "stiffness_step",
        "another",
        stiffness_decay,
        lambda layer, rng: {"lost": 0.15, "date": rng.uniform(25 * DAY, 75 * DAY), "k": layer.k},
        ("lost",),
        limits={"lost": 0.6},
    ),
    Law(
        "residual_offset",
        "residual_offset",
        "same",
        offset,
        lambda layer, rng: {"force": layer.F_y * rng.uniform(0.3, 0.9), "travel": layer.D_y * rng.uniform(0.8, 2.0)},
        ("force",),
        states=1,
    ),
)
