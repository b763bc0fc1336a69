"""Hidden laws of the velocity."""

import math

from numba import njit

from hidden.law import Law

HALVINGS = 60
"""Halvings of the range of a braced damper's force, to below rounding."""


def power(p, s, s1, step, past):
    """`force` at 0.1 m/s."""
    return math.copysign(p[0] * (abs(step.v) / 0.1) ** p[1], step.v)


def two_slopes(p, s, s1, step, past):
    """Difference of a two-slope damper from its second slope: steep to `corner`, then level."""
    return p[0] * max(-1.0, min(1.0, step.v / p[1]))


def eyring(p, s, s1, step, past):
    return p[0] * math.asinh(step.v / p[1])


def cross(p, s, s1, step, past):
    """A dashpot that thins beyond p[1] as the fluid of Cross (1965), by the power p[2]."""
    return p[0] * step.v / p[1] / (1.0 + (abs(step.v) / p[1]) ** p[2])


def relief(p, s, s1, step, past):
    """Beyond p[1] the share p[0] of a dashpot p[2] is gone."""
    return -p[0] * p[2] * math.copysign(max(abs(step.v) - p[1], 0.0), step.v)


def smooth_relief(p, s, s1, step, past):
    """The valve opens little by little: a hyperbola in place of the corner, with no force at rest."""
    ratio = step.v / p[1]
    return -p[0] * p[2] * step.v * ratio * ratio / (1.0 + ratio * ratio)


def maxwell(p, s, s1, step, past):
    """Exact over a step of constant velocity. State: force."""
    lasting = math.exp(-step.h / p[1])
    s1[0] = s[0] * lasting + p[0] * p[1] * (1.0 - lasting) * (step.u - step.u0) / step.h
    return s1[0]


def maxwell_ladder(p, s, s1, step, past):
    """Four branches, each three times as slow as the one before: a relaxation that nearly is a power of time."""
    force = 0.0
    for branch in range(4):
        tau = p[1] * 3.0**branch
        lasting = math.exp(-step.h / tau)
        s1[branch] = s[branch] * lasting + p[0] * 0.75**branch * tau * (1.0 - lasting) * (step.u - step.u0) / step.h
        force += s1[branch]
    return force


@njit
def valve(force, c, opens, left):
    """Speed of an oil damper under a force."""
    beyond = max(abs(force) - c * opens, 0.0)
    return math.copysign((abs(force) - beyond) / c + beyond / (left * c), force)


def braced_valve(p, s, s1, step, past):
    """Oil damper p[0] with a valve at p[1], beyond which the share p[2] remains, on a brace of stiffness p[3].

    State: force. Its end is where the implicit trapezoidal rule is met, between those with the damper stuck and free.
    """
    h, before = step.h, valve(s[0], p[0], p[1], p[2]) if p[0] > 0 else 0.0
    low, high = s[0] - p[3] * 2.0 * (abs(step.u - step.u0) + h * abs(before)), 0.0
    high = 2.0 * s[0] - low
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if (
            p[0] == 0.0
            or (middle - s[0]) / p[3] + 0.5 * h * (before + valve(middle, p[0], p[1], p[2])) > step.u - step.u0
        ):
            high = middle
        else:
            low = middle
    s1[0] = 0.5 * (low + high) if p[0] > 0 else 0.0
    return s1[0]


def braced_power(p, s, s1, step, past):
    """Damper with p[0] at 0.1 m/s and the power p[1], on a brace that gives by p[2] under p[0].

    State: force over p[0]; as above, but by backward Euler, since the damper's slope has no bound.
    """
    low, high = s[0] - 2.0 * abs(step.u - step.u0) / p[2] - abs(s[0]), 0.0
    high = 2.0 * s[0] - low
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        slips = math.copysign(0.1 * abs(middle) ** (1.0 / p[1]), middle)
        if (middle - s[0]) * p[2] + step.h * slips > step.u - step.u0:
            high = middle
        else:
            low = middle
    s1[0] = 0.5 * (low + high)
    return p[0] * s1[0]


def displacement_damping(p, s, s1, step, past):
    """`damping` at the displacement `at`."""
    return p[0] * (step.u / p[1]) ** 2 * step.v


def displacement_damping_straight(p, s, s1, step, past):
    return p[0] * abs(step.u / p[1]) * step.v


def inerter(p, s, s1, step, past):
    return p[0] * step.a


def swinging(p, s, s1, step, past):
    """A mass behind a spring and a dashpot, led by the layer's motion against the ground; the trapezoidal rule.

    An inerter behind a spring (Lazar, Neild and Wagg, 2014). States: its displacement, velocity and acceleration.
    """
    mass, omega, zeta, h = p[0], p[1], p[2], step.h
    free_u, free_v = s[0] + h * s[1] + 0.25 * h * h * s[2], s[1] + 0.5 * h * s[2]
    a = omega * omega * (step.u - free_u) + 2.0 * zeta * omega * (step.v - free_v)
    a /= 1.0 + 0.25 * h * h * omega * omega + zeta * omega * h
    s1[0], s1[1], s1[2] = free_u + 0.25 * h * h * a, free_v + 0.5 * h * a, a
    return mass * a


def swinging_on_slab(p, s, s1, step, past):
    """A tuned mass on the slab (den Hartog, 1956), driven by its absolute acceleration; states as above."""
    mass, omega, zeta, h = p[0], p[1], p[2], step.h
    free_u, free_v = s[0] + h * s[1] + 0.25 * h * h * s[2], s[1] + 0.5 * h * s[2]
    a = -step.slab - omega * omega * free_u - 2.0 * zeta * omega * free_v
    a /= 1.0 + 0.25 * h * h * omega * omega + zeta * omega * h
    s1[0], s1[1], s1[2] = free_u + 0.25 * h * h * a, free_v + 0.5 * h * a, a
    return mass * (step.slab + a)


LAWS = (
    Law(
        "power_viscous",
        "power_viscous",
        "same",
        power,
        lambda layer, rng: {
            "force": layer.peak_force * 0.05,
            "exponent": float(rng.choice([rng.uniform(0.25, 0.7), rng.uniform(1.5, 2.6)])),
        },
        ("force",),
    ),
    Law(
        "power_viscous_two_slopes",
        "power_viscous",
        "another",
        two_slopes,
        lambda layer, rng: {"force": layer.peak_force * 0.05, "corner": layer.speed * rng.uniform(0.05, 0.4)},
        ("force",),
    ),
    Law(
        "power_viscous_cross",
        "power_viscous",
        "another",
        cross,
        lambda layer, rng: {
            "force": layer.peak_force * 0.05,
            "thins": layer.speed * rng.uniform(0.02, 0.3),
            "power": rng.uniform(0.4, 0.8),
        },
        ("force",),
    ),
    Law(
        "logarithmic_viscous",
        "logarithmic_viscous",
        "same",
        eyring,
        lambda layer, rng: {"force": layer.peak_force * 0.02, "slow": layer.speed * 10 ** rng.uniform(-2.5, -1.0)},
        ("force",),
    ),
    Law(
        "relief",
        "relief",
        "same",
        relief,
        lambda layer, rng: {"share": 0.5, "opens": layer.speed * rng.uniform(0.05, 0.4), "c": layer.c},
        ("share",),
        limits={"share": 0.95},
    ),
    Law(
        "relief_smooth",
        "relief",
        "another",
        smooth_relief,
        lambda layer, rng: {"share": 0.5, "opens": layer.speed * rng.uniform(0.05, 0.5), "c": layer.c},
        ("share",),
        limits={"share": 0.85},
    ),
    Law(
        "maxwell",
        "maxwell",
        "same",
        maxwell,
        lambda layer, rng: {"stiffness": layer.k * 0.2, "time": 10 ** rng.uniform(-1.5, 0.5)},
        ("stiffness",),
        states=1,
    ),
    Law(
        "maxwell_ladder",
        "maxwell",
        "another",
        maxwell_ladder,
        lambda layer, rng: {"stiffness": layer.k * 0.1, "time": 10 ** rng.uniform(-1.5, -0.7)},
        ("stiffness",),
        states=4,
    ),
    Law(
        "braced_power",
        "braced_viscous",
        "same",
        braced_power,
        lambda layer, rng: {
            "force": layer.peak_force * 0.05,
            "exponent": rng.uniform(0.3, 0.7),
            "give": layer.peak * rng.uniform(0.05, 0.3),
        },
        ("force",),
        states=1,
    ),
    Law(
        "braced_relief",
        "braced_relief",
        "same",
        braced_valve,
        lambda layer, rng: {
            "c": 0.05 * layer.peak_force / (opens := layer.speed * rng.uniform(0.1, 0.3)),
            "opens": opens,
            "left": rng.uniform(0.03, 0.2),
            "brace": 0.05 * layer.peak_force / (layer.peak * rng.uniform(0.05, 0.3)),
        },
        ("c", "brace"),
        states=1,
    ),
    *(
        Law(
            name,
            "displacement_damping",
            "same" if advance is displacement_damping else "another",
            advance,
            lambda layer, rng: {"damping": layer.c * 1.5, "at": layer.peak},
            ("damping",),
        )
        for name, advance in (
            ("displacement_damping", displacement_damping),
            ("displacement_damping_straight", displacement_damping_straight),
        )
    ),
    Law("inerter", "inerter", "same", inerter, lambda layer, rng: {"mass": 1.5e6}, ("mass",), limits={"mass": 8e6}),
    *(
        Law(
            name,
            effect,
            form,
            advance,
            lambda layer, rng, low=low, high=high: {
                "mass": 5e5,
                "omega": 2 * math.pi * 10 ** rng.uniform(math.log10(low), math.log10(high)),
                "zeta": rng.uniform(0.02, 0.15),
            },
            ("mass",),
            states=3,
            limits={"mass": 3e6},
        )
        for name, effect, form, advance, low, high in (
            ("resonator", "resonator", "same", swinging, 0.8, 6.0),
            ("resonator_on_slab", "tuned_mass", "same", swinging_on_slab, 0.8, 6.0),
            ("inerter_on_spring", "inerter", "another", swinging, 8.0, 15.0),
        )
    ),
)
