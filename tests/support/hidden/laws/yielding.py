"""Hidden forms of the yielding damper itself: each takes the place of the usual one. State 0 is z."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from numba import njit

from hidden.law import Law, Layer

LONGEST = 0.05
"""Of a yield displacement: longest piece of a travel that is integrated at once."""


@njit
def slope(z, sign, energy, p):
    """dz/dξ over a travel ξ in yield displacements, of the sign given.

    Baber and Wen (1981) for ν and η, Baber and Noori (1986) for the pinching.
    """
    beta, excess, weaker, softer, z1, z2, q = p[2], p[3], p[4], p[5], p[6], p[7], p[8]
    nu, eta = 1.0 + weaker * energy, 1.0 + softer * energy
    bend = (1.0 - beta) * z * sign + beta * abs(z)
    if excess != 0.0:
        bend *= abs(z) ** excess if z != 0.0 else 0.0
    opened = 1.0 if z1 == 0.0 else 1.0 - z1 * math.exp(-(((z * sign - q) / z2) ** 2))
    return opened * sign * (1.0 - nu * bend) / eta


def general(p, s, s1, step, past):
    """States: z, z of the other axis, dissipated energy in yield forces times yield displacements.

    `joined` is λ of Park, Wen and Ang (1986), by which motion along one axis also yields the other.
    """
    D_y, beta, joined = p[1], p[2], p[9]
    du, dc = (step.u - step.u0) / D_y, (step.u_cross - step.u_cross0) / D_y
    pieces = 1 + int(max(abs(du), abs(dc)) / LONGEST)
    h, hc = abs(du) / pieces, abs(dc) / pieces
    sx, sy = (1.0 if du >= 0 else -1.0), (1.0 if dc >= 0 else -1.0)
    x, y, energy = s[0], s[1], s[2]
    for _ in range(pieces):
        mx, my = x, y
        for part in (0.5, 1.0):  # the midpoint rule
            along = (1.0 - beta) * mx * sx + beta * abs(mx)
            across = (1.0 - beta) * my * sy + beta * abs(my)
            nx = x + part * (h * slope(mx, sx, energy, p) - joined * hc * across * mx)
            ny = y + part * (hc * slope(my, sy, energy, p) - joined * h * along * my)
            mx, my = nx, ny
        energy += 0.5 * (x + mx) * sx * h
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


def _dahl(p, s, s1, step, past):
    """Dahl (1968): dz/dξ = |1 − z s|^i sign(1 − z s), the exponent i being 1 + `excess`."""
    du = (step.u - step.u0) / p[1]
    pieces = 1 + int(abs(du) / LONGEST)
    sign, h, z = (1.0 if du >= 0 else -1.0), abs(du) / pieces, s[0]
    for _ in range(pieces):
        middle = z
        for part in (0.5, 1.0):
            left = 1.0 - middle * sign
            middle = z + part * h * sign * (abs(left) ** (1.0 + p[2]) if left > 0 else 0.0)
        z = middle
    s1[0] = z
    return p[0] * z


def slipping(p, s, s1, step, past):
    """In series with a slipping joint (Baber and Noori, 1985): near z = 0 the joint opens by a share of the travel.

    The share is that of a parabola of z, which is 1 − `loose` at zero and 1 from `closed` on.
    """
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


Drawn = Callable[[np.random.Generator], dict[str, float]]


def _with(drawn: Drawn) -> Callable[[Layer, np.random.Generator], Mapping[str, float]]:
    """The layer's own yielding, and what is drawn changed in it."""

    def values(layer: Layer, rng: np.random.Generator) -> Mapping[str, float]:
        plain = {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta, "excess": 0.0, "weaker": 0.0, "softer": 0.0}
        return plain | {"z1": 0.0, "z2": 1.0, "q": 0.0, "joined": 0.0} | drawn(rng)

    return values


def _general(name: str, drawn: Drawn, strength: tuple[str, ...], limits: Mapping[str, float] | None = None) -> Law:
    carried = (2,) if "weaker" in strength else ()
    return Law(
        name,
        name,
        "same",
        general,
        _with(drawn),
        strength,
        states=3,
        carried=carried,
        limits=limits,
        kind="yielding",
    )


SHARPNESS = _general("sharpness", lambda rng: {"excess": rng.uniform(0.5, 3.0)}, ("excess",), {"excess": 5.0})
DEGRADATION = _general(
    "degradation",
    lambda rng: {"weaker": rng.uniform(0.002, 0.02), "softer": rng.uniform(0.0, 0.02)},
    ("weaker", "softer"),
    {"weaker": 0.2, "softer": 0.2},
)
PINCHING = _general(
    "pinching",
    lambda rng: {"z1": rng.uniform(0.3, 0.95), "z2": rng.uniform(0.08, 0.5), "q": rng.uniform(0.0, 0.4)},
    ("z1",),
    {"z1": 0.97},
)
BIAXIAL = _general("biaxial", lambda rng: {"joined": rng.uniform(0.4, 1.2)}, ("joined",), {"joined": 1.2})
LAWS = (SHARPNESS, DEGRADATION, PINCHING)
