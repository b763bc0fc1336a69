"""Hidden laws that no library of isolator effects is likely to have."""

import math

from numba import njit

from hidden.law import Law


@njit
def chance(number):
    """Within [0, 1), the same for the same number: the fraction of a large multiple of its sine."""
    large = math.sin(number * 12.9898) * 43758.5453
    return large - math.floor(large)


def delayed(p, s, s1, step, past):
    """A device that feeds the displacement back too late: by p[1] seconds."""
    place = step.index - p[1] / step.h
    if place < 0:
        return 0.0
    before = int(place)
    share = place - before
    after = past[before + 1] if before + 1 < step.index else step.u
    return p[0] * ((1.0 - share) * past[before] + share * after)


def wavy(p, s, s1, step, past):
    """Something ratchets over teeth: a force that goes round and round with the displacement."""
    return p[0] * math.sin(step.u / p[1])


def sticking(p, s, s1, step, past):
    """Now and then, for about a second, something jams and then breaks loose. States: anchor, whether it holds."""
    number = math.floor(step.time / p[2])
    if chance(number + 0.37) > 0.15:
        s1[0], s1[1] = step.u, 0.0
        return 0.0
    s1[1] = 1.0
    anchor = s[0] if s[1] > 0 else step.u0
    s1[0] = min(max(anchor, step.u - p[1]), step.u + p[1])
    return p[0] * (step.u - s1[0]) / p[1]


def two_masses(p, s, s1, step, past):
    """A swinging mass with a smaller one on it, both on the slab. States: u, v of each; the implicit midpoint rule."""
    first, second, omega, other, zeta, h = p[0], p[1], p[2], p[3], 0.03, step.h
    k1, k2 = first * omega * omega, second * other * other
    c1, c2 = 2 * zeta * first * omega, 2 * zeta * second * other
    x0, w0, y0, g0, slab = s[0], s[1], s[2], s[3], (step.slab0 + step.slab) / 2
    # velocities at the end: (M + h C / 2 + h² K / 4) w = (M − h C / 2 − h² K / 4) w0 − h K x0 − h M slab
    a11 = first + h / 2 * (c1 + c2) + h * h / 4 * (k1 + k2)
    a12 = -h / 2 * c2 - h * h / 4 * k2
    a22 = second + h / 2 * c2 + h * h / 4 * k2
    b1 = (2 * first - a11) * w0 - a12 * g0 - h * ((k1 + k2) * x0 - k2 * y0) - h * first * slab
    b2 = (2 * second - a22) * g0 - a12 * w0 - h * (k2 * (y0 - x0)) - h * second * slab
    determinant = a11 * a22 - a12 * a12
    w, g = (a22 * b1 - a12 * b2) / determinant, (a11 * b2 - a12 * b1) / determinant
    s1[0], s1[1], s1[2], s1[3] = x0 + h / 2 * (w0 + w), w, y0 + h / 2 * (g0 + g), g
    return -k1 * s1[0] - c1 * w


def bump(p, s, s1, step, past):
    """Negative stiffness over a range of displacement, and none beyond it."""
    x = step.u / p[1]
    return -p[0] * x * math.exp(-0.5 * x * x)


def fractional(p, s, s1, step, past):
    """A springpot of order p[1] (Koeller, 1984) over the last two seconds: Grünwald and Letnikov's sum, at 10 ms."""
    stride = max(int(0.01 / step.h + 0.5), 1)
    total, weight, place = step.u, 1.0, step.index
    for j in range(1, 200):
        place -= stride
        if place < 0:
            break
        weight *= 1.0 - (p[1] + 1.0) / j
        total += weight * past[place]
    return p[0] * (stride * step.h) ** -p[1] * total


def gated(p, s, s1, step, past):
    """A damper that only works while the layer moves inwards."""
    return p[0] * step.v if step.u * step.v < 0 else 0.0


LAWS = (
    Law(
        "delayed_feedback",
        "",
        "outside",
        delayed,
        lambda layer, rng: {"stiffness": layer.k * 0.1, "late": rng.uniform(0.3, 0.9)},
        ("stiffness",),
    ),
    Law(
        "wavy_force",
        "",
        "outside",
        wavy,
        lambda layer, rng: {"force": layer.peak_force * 0.05, "length": layer.peak * rng.uniform(0.03, 0.12)},
        ("force",),
    ),
    Law(
        "random_sticking",
        "",
        "outside",
        sticking,
        lambda layer, rng: {"force": layer.peak_force * 0.1, "slip": rng.uniform(1e-3, 8e-3), "every": 1.3},
        ("force",),
        states=2,
    ),
    Law(
        "two_masses",
        "tuned_mass",
        "another",
        two_masses,
        lambda layer, rng: {
            "first": 8e5,
            "second": 4e5,
            "omega": 2 * math.pi * rng.uniform(0.8, 1.5),
            "other": 2 * math.pi * rng.uniform(2.0, 4.0),
        },
        ("first", "second"),
        states=4,
        limits={"first": 3e6, "second": 1.5e6},
    ),
    Law(
        "negative_bump",
        "",
        "outside",
        bump,
        lambda layer, rng: {"force": layer.peak_force * 0.1, "at": layer.peak * rng.uniform(0.1, 0.3)},
        ("force",),
    ),
    Law(
        "fractional_derivative",
        "",
        "outside",
        fractional,
        lambda layer, rng: {"force": layer.k * 0.05, "order": rng.uniform(0.3, 0.7)},
        ("force",),
    ),
    Law(
        "inward_damper",
        "",
        "outside",
        gated,
        lambda layer, rng: {"damping": layer.c},
        ("damping",),
    ),
)
