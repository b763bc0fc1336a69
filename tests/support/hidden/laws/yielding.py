"""Hidden forms of the yielding damper itself: each takes the place of the usual one. State 0 is z."""

import math
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numba import njit

from hidden.law import Law, Layer

LONGEST = 0.05
"""Longest piece of a travel that is integrated at once, in yield displacements."""


@njit
def slope(z, sign, energy, p):
    """dz/dξ over a travel ξ in yield displacements, of the sign given, after an energy.

    Baber and Wen (1981) for ν and η, equal by p[4], apart by p[9] and p[10]; Baber and Noori (1986) for the pinching,
    which is there from the beginning, or grows over p[11].
    """
    beta, excess, z1, z2, q = p[2], p[3], p[5], p[6], p[7]
    worn, weaker, softer = 1.0 + p[4] * energy, 1.0 + p[9] * energy, 1.0 + p[10] * energy
    if p[11] > 0.0:
        z1 *= 1.0 - math.exp(-energy / p[11])
    bend = (1.0 - beta) * z * sign + beta * abs(z)
    if excess != 0.0:
        bend *= max(abs(z), 1e-12) ** excess
    opened = 1.0 if z1 == 0.0 else 1.0 - z1 * math.exp(-(((z * sign - q) / z2) ** 2))
    return opened * sign * (1.0 / worn - weaker * bend) / softer


def general(p, s, s1, step, past):
    """States: z, z of the other axis, work per yield force in m.

    `joined` is λ of Park, Wen and Ang (1986), by which motion along one axis also yields the other.
    """
    D_y, joined = p[1], p[8]
    du, dc = (step.u - step.u0) / D_y, (step.u_cross - step.u_cross0) / D_y
    pieces = 1 + int(max(abs(du), abs(dc)) * (1.0 + p[9] * max(s[2], 0.0)) / LONGEST)
    h, hc = abs(du) / pieces, abs(dc) / pieces
    sx, sy = (1.0 if du >= 0 else -1.0), (1.0 if dc >= 0 else -1.0)
    x, y, energy = s[0], s[1], s[2]
    for _ in range(pieces):
        mx, my, spent = x, y, max(energy, 0.0)
        for part in (0.5, 1.0):  # the midpoint rule
            along, across = max(mx * sx, 0.0), max(my * sy, 0.0)
            nx = x + part * (h * slope(mx, sx, spent, p) - joined * hc * across * mx)
            ny = y + part * (hc * slope(my, sy, spent, p) - joined * h * along * my)
            mx, my = nx, ny
        energy += 0.5 * (x + mx) * sx * h * D_y
        x, y = mx, my
    s1[0], s1[1], s1[2] = x, y, energy
    return p[0] * x


def circular(p, s, s1, step, past):
    """Yielding on a circle (Casciati, 1989): dz = du − z (z·du + |z·du|) / 2|z|. States: z along both axes."""
    D_y, joined = p[1], p[2]
    du, dc = (step.u - step.u0) / D_y, joined * (step.u_cross - step.u_cross0) / D_y
    pieces = 1 + int(max(abs(du), abs(dc)) / LONGEST)
    du, dc, x, y = du / pieces, dc / pieces, s[0], s[1]
    for _ in range(pieces):
        mx, my = x, y
        for part in (0.5, 1.0):
            work, size = mx * du + my * dc, math.hypot(mx, my)
            share = part * 0.5 * (work + abs(work)) / size if size > 0 else 0.0
            mx, my = x + part * du - share * mx, y + part * dc - share * my
        x, y = mx, my
    s1[0], s1[1] = x, y
    return p[0] * x


def dahl(p, s, s1, step, past):
    """Dahl (1968): dz/dξ = |1 − z s|^i, the exponent i being 1 less the share `sharper`."""
    du = (step.u - step.u0) / p[1]
    pieces = 1 + int(abs(du) / LONGEST)
    sign, h, z = (1.0 if du >= 0 else -1.0), abs(du) / pieces, s[0]
    for _ in range(pieces):
        middle = z
        for part in (0.5, 1.0):
            left = max(1.0 - middle * sign, 0.0)
            middle = z + part * h * sign * left ** (1.0 - p[2])
        z = max(-1.0, min(1.0, middle))
    s1[0] = z
    return p[0] * z


def slipping(p, s, s1, step, past):
    """In series with a joint that slips near zero force: there the slope is less by `loose`, a parabola in z."""
    F_y, D_y, beta, loose, closed = p[0], p[1], p[2], p[3], p[4]
    du = (step.u - step.u0) / D_y
    pieces = 1 + int(abs(du) / LONGEST)
    sign, h, z = (1.0 if du >= 0 else -1.0), abs(du) / pieces, s[0]
    for _ in range(pieces):
        middle = z
        for part in (0.5, 1.0):
            stiff = 1.0 - loose * max(1.0 - (middle / closed) ** 2, 0.0)
            bend = (1.0 - beta) * middle * sign + beta * abs(middle)
            middle = z + part * h * sign * stiff * (1.0 - bend)
        z = middle
    s1[0] = z
    return F_y * z


def left_aside(p, s, s1, step, past):
    """The layer stands off its centre by `aside`, the damper holding the rubber's force; u counts from there.

    States: z, and 1 once the layer has moved.
    """
    F_y, D_y, aside = p[0], p[1], p[2]
    held = min(p[3] * aside / F_y, 0.999)
    z, du = (s[0] if s[1] > 0 else -held), (step.u - step.u0) / D_y
    s1[1] = 1.0
    sign = 1.0 if du >= 0 else -1.0
    left, w = abs(du), z * sign
    if w < 0:  # β = γ: unloading is straight
        w, left = min(w + left, 0.0), max(left + w, 0.0)
    s1[0] = sign * (1.0 - (1.0 - w) * math.exp(-left) if left > 0 else w)
    return F_y * (s1[0] + held)


Drawn = Callable[[np.random.Generator], dict[str, float]]
REST = {"excess": 0.0, "wear": 0.0, "z1": 0.0, "z2": 1.0, "q": 0.0, "joined": 0.0} | {
    "weaker": 0.0,
    "softer": 0.0,
    "grows": 0.0,
}
"""Values at which the general form is the usual one."""


def _general(drawn: Drawn) -> Callable[[Layer, np.random.Generator], Mapping[str, float]]:
    return lambda layer, rng: {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta} | REST | drawn(rng)


def _plain(drawn: Drawn) -> Callable[[Layer, np.random.Generator], Mapping[str, float]]:
    return lambda layer, rng: {"F_y": layer.F_y, "D_y": layer.D_y} | drawn(rng)


_law = partial(Law, kind="yielding")
SHARPNESS = _law(
    "sharpness",
    "yield_sharpness",
    "same",
    general,
    _general(lambda rng: {"excess": rng.uniform(0.5, 3.0)}),
    strength=("excess",),
    states=3,
    limits={"excess": 5.0},
)
DAHL = _law(
    "sharpness_dahl",
    "yield_sharpness",
    "another",
    dahl,
    _plain(lambda rng: {"sharper": rng.uniform(0.3, 0.9)}),
    strength=("sharper",),
    states=1,
    limits={"sharper": 0.95},
)
DEGRADATION = _law(
    "degradation",
    "degradation",
    "same",
    general,
    _general(lambda rng: {"wear": rng.uniform(0.05, 0.5)}),
    strength=("wear",),
    states=3,
    carried=(2,),
    limits={"wear": 10.0},
)
PINCHING = _law(
    "pinching",
    "pinching",
    "same",
    general,
    _general(lambda rng: {"z1": rng.uniform(0.3, 0.95), "z2": rng.uniform(0.08, 0.5), "q": rng.uniform(0.0, 0.4)}),
    strength=("z1",),
    states=3,
    limits={"z1": 0.95},
)
WEAKENING = _law(
    "strength_degradation",
    "strength_degradation",
    "same",
    general,
    _general(lambda rng: {"weaker": rng.uniform(0.05, 0.5)}),
    strength=("weaker",),
    states=3,
    carried=(2,),
    limits={"weaker": 10.0},
)
SOFTENING = _law(
    "stiffness_degradation",
    "stiffness_degradation",
    "same",
    general,
    _general(lambda rng: {"softer": rng.uniform(0.2, 2.0)}),
    strength=("softer",),
    states=3,
    carried=(2,),
    limits={"softer": 40.0},
)
GROWING = _law(
    "growing_pinching",
    "growing_pinching",
    "same",
    general,
    _general(
        lambda rng: {
            "z1": rng.uniform(0.5, 0.95),
            "z2": rng.uniform(0.1, 0.5),
            "q": rng.uniform(0.0, 0.4),
            "grows": 10 ** rng.uniform(-0.3, 0.5),
        }
    ),
    strength=("z1",),
    states=3,
    carried=(2,),
    limits={"z1": 0.95},
)
SLIPPING = _law(
    "pinching_slip_lock",
    "pinching",
    "another",
    slipping,
    lambda layer, rng: (
        {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta}
        | {"loose": rng.uniform(0.4, 0.95), "closed": rng.uniform(0.2, 0.6)}
    ),
    strength=("loose",),
    states=1,
    limits={"loose": 0.97},
)
BIAXIAL = _law(
    "biaxial",
    "biaxial",
    "same",
    general,
    _general(lambda rng: {"beta": 0.5, "joined": rng.uniform(0.4, 1.2)}),
    strength=("joined",),
    states=3,
    limits={"joined": 1.2},
    needs=("cross",),
)
CIRCULAR = _law(
    "biaxial_circular",
    "biaxial",
    "another",
    circular,
    _plain(lambda rng: {"joined": 1.0}),
    strength=("joined",),
    states=2,
    limits={"joined": 1.0},
    needs=("cross",),
)
ASIDE = _law(
    "offset_left_aside",
    "residual_offset",
    "another",
    left_aside,
    lambda layer, rng: {
        "F_y": layer.F_y,
        "D_y": layer.D_y,
        "aside": layer.F_y / layer.k * rng.uniform(0.3, 0.9),
        "k": layer.k,
    },
    strength=("aside",),
    states=2,
)
LAWS = (SHARPNESS, DAHL, DEGRADATION, PINCHING, WEAKENING, SOFTENING, GROWING, SLIPPING, BIAXIAL, CIRCULAR, ASIDE)
