"""Hidden friction and hysteresis beside the damper's."""

import math

from numba import njit

from hidden.law import Law

SHARE = 0.04
"""Initial strength of such a law over the layer's peak force."""


@njit
def slid(z, travel):
    """Elastic slip (Wen, 1976, n = 2, β = γ) after a travel in slip lengths: unloading straight, loading 1 − z²."""
    sign = 1.0 if travel >= 0 else -1.0
    left, w = abs(travel), z * sign
    if w < 0:
        w, left = min(w + left, 0.0), max(left + w, 0.0)
    grown = math.tanh(left)
    return sign * (w if left == 0 else (w + grown) / (1.0 + w * grown))


@njit
def dahl(z, travel):
    """Elastic slip (Dahl, 1968) after a travel in slip lengths: 1 − z in the direction of the travel."""
    sign = 1.0 if travel >= 0 else -1.0
    return sign + (z - sign) * math.exp(-abs(travel))


@njit
def sliding(p, s, s1, step):
    """Constantinou, Mokha and Reinhorn (1990): slow sliding has less of it, and it bites over an elastic length."""
    fast, lost, sharp, length = p[0], p[1], p[2], p[3]
    s1[0] = slid(s[0], (step.u - step.u0) / length)
    return fast * (1.0 - lost * math.exp(-sharp * abs(step.v))) * s1[0]


def friction(p, s, s1, step, past):
    return sliding(p, s, s1, step)


def load_friction(p, s, s1, step, past):
    """The same under the vertical load of each instant."""
    return (1.0 + step.vertical) * sliding(p, s, s1, step)


def sharp_friction(p, s, s1, step, past):
    """A spring until the friction bounds its force (return mapping, Simo & Hughes 1998). State: share of the force."""
    return stuck(p, s, s1, step, 1.0)


def sharp_load_friction(p, s, s1, step, past):
    """The same where the vertical load of each instant moves the bound."""
    return stuck(p, s, s1, step, max(1.0 + step.vertical, 0.0))


@njit
def stuck(p, s, s1, step, load):
    """Return mapping: a spring whose force the friction under a load bounds."""
    fast, lost, sharp, length = p[0], p[1], p[2], p[3]
    bound = load * (1.0 - lost * math.exp(-sharp * abs(step.v)))
    s1[0] = max(-bound, min(bound, s[0] + (step.u - step.u0) / length))
    return fast * s1[0]


def smooth_friction(p, s, s1, step, past):
    return p[0] * math.tanh(step.v / p[1])


def exponential_friction(p, s, s1, step, past):
    """Threlfall (1978): 95 % of the force at its speed."""
    return p[0] * math.copysign(1.0 - math.exp(-3.0 * abs(step.v) / p[1]), step.v)


def lugre_friction(p, s, s1, step, past):
    """Canudas de Wit et al. (1995), its bristles exact over a step of constant velocity."""
    sliding, sticking, slow, length = p[0], p[1], p[2], p[3]
    level = 1.0 + (sticking - 1.0) * math.exp(-((step.v / slow) ** 2))
    travel = step.u - step.u0
    sign = 1.0 if travel >= 0 else -1.0
    s1[0] = sign * level + (s[0] - sign * level) * math.exp(-abs(travel) / (length * level))
    return sliding * s1[0]


def breakaway(p, s, s1, step, past):
    """Stribeck's excess by Bo and Pavelescu (1982), Gaussian in the velocity."""
    s1[0] = slid(s[0], (step.u - step.u0) / p[2])
    return p[0] * math.exp(-((step.v / p[1]) ** 2)) * s1[0]


def slow_breakaway(p, s, s1, step, past):
    """The excess falls as 1 / (1 + (v/v_s)²) (Hess and Soom, 1990)."""
    s1[0] = dahl(s[0], (step.u - step.u0) / p[2])
    return p[0] / (1.0 + (step.v / p[1]) ** 2) * s1[0]


def second_hysteresis(p, s, s1, step, past):
    travel = (step.u - step.u0) / p[1]
    sign = 1.0 if travel >= 0 else -1.0
    left, w = abs(travel), s[0] * sign
    if w < 0:  # β = γ: unloading is straight
        w, left = min(w + left, 0.0), max(left + w, 0.0)
    s1[0] = sign * (1.0 - (1.0 - w) * math.exp(-left) if left > 0 else w)
    return p[0] * s1[0]


def bilinear_hysteresis(p, s, s1, step, past):
    s1[0] = max(-1.0, min(1.0, s[0] + (step.u - step.u0) / p[1]))
    return p[0] * s1[0]


def ozdemir_hysteresis(p, s, s1, step, past):
    """Özdemir (1976), exponent 3: z' = v − |v| z³, the midpoint rule in pieces."""
    travel = (step.u - step.u0) / p[1]
    pieces = 1 + int(abs(travel) / 0.05)
    d, z = travel / pieces, s[0]
    for _ in range(pieces):
        middle = z + 0.5 * (d - abs(d) * z**3)
        z += d - abs(d) * middle**3
    s1[0] = z
    return p[0] * z


def sharp_hysteresis(p, s, s1, step, past):
    """Wen (1976) with β = γ: unloading straight, then z' = 1 − z^n over the travel, the midpoint rule in pieces."""
    travel = (step.u - step.u0) / p[1]
    sign = 1.0 if travel >= 0 else -1.0
    left, w = abs(travel), s[0] * sign
    if w < 0:
        w, left = min(w + left, 0.0), max(left + w, 0.0)
    pieces = 1 + int(left * p[2] / 0.1) if left > 0 else 0
    for _ in range(pieces):
        d = left / pieces
        middle = w + 0.5 * d * (1.0 - w ** p[2])
        w = min(w + d * (1.0 - middle ** p[2]), 1.0)
    s1[0] = sign * w
    return p[0] * s1[0]


def menegotto_hysteresis(p, s, s1, step, past):
    """Menegotto and Pinto (1973) without hardening: from each reversal one curve to the yield force on the other side.

    States: force over the yield force, direction, and the displacement and that force at the reversal.
    """
    length, roundness = p[1], p[2]
    travel = step.u - step.u0
    s1[1], s1[2], s1[3] = s[1], s[2], s[3]
    if (travel != 0.0 and (travel > 0) != (s[1] > 0)) or s[1] == 0.0:
        s1[1], s1[2], s1[3] = (1.0 if travel >= 0 else -1.0), step.u0, s[0]
    way = s1[1] - s1[3]
    if abs(way) < 1e-12:
        s1[0] = s1[1]
        return p[0] * s1[0]
    share = max((step.u - s1[2]) / (length * way), 0.0)
    s1[0] = s1[3] + way * share / (1.0 + share**roundness) ** (1.0 / roundness)
    return p[0] * s1[0]


def steel_hysteresis(p, s, s1, step, past):
    """The same with a roundness that depends on the excursions: Filippou, Popov and Bertero (1983), eqs 2 to 5.

    States: as above; then, over the yield displacement, the largest and the least displacement of the reversals, or one
    before the first of them, and how far the running curve's yield lies within the one that it leads to.
    """
    length, first = p[1], p[2]
    travel = step.u - step.u0
    for place in range(1, 7):
        s1[place] = s[place]
    if (travel != 0.0 and (travel > 0) != (s[1] > 0)) or s[1] == 0.0:
        sign = 1.0 if travel >= 0 else -1.0
        turn = step.u0 / length
        if s[1] == 0.0:
            s1[4], s1[5] = 1.0, -1.0
        elif sign < 0:
            s1[4] = max(s[4], turn)
        else:
            s1[5] = min(s[5], turn)
        s1[1], s1[2], s1[3] = sign, step.u0, s[0]
        s1[6] = abs((s1[4] if sign > 0 else s1[5]) - (turn + sign - s[0]))
    way = s1[1] - s1[3]
    if abs(way) < 1e-12:
        s1[0] = s1[1]
        return p[0] * s1[0]
    roundness = first * (1.0 - 0.925 * s1[6] / (0.15 + s1[6]))
    share = max((step.u - s1[2]) / (length * way), 0.0)
    s1[0] = s1[3] + way * share / (1.0 + share**roundness) ** (1.0 / roundness)
    return p[0] * s1[0]


def flag(p, s, s1, step, past):
    """Christopoulos, Filiatrault and Folz (2002): opens at a force, closes at a lower one."""
    travel = (step.u - step.u0) / p[2]
    sign = 1.0 if travel >= 0 else -1.0
    left, w = abs(travel), s[0] * sign
    if w < 0:
        w, left = min(w + left, 0.0), max(left + w, 0.0)
    s1[0] = sign * (1.0 - (1.0 - w) * math.exp(-left) if left > 0 else w)
    opened = max(-1.0, min(1.0, step.u / p[2]))
    return p[0] * ((1.0 - 0.5 * p[1]) * opened + 0.5 * p[1] * abs(opened) * s1[0])


def sharp_flag(p, s, s1, step, past):
    """The same with corners: between its two lines the force moves along the elastic slope. State: its share."""
    opened = max(-1.0, min(1.0, step.u / p[2]))
    closing = (1.0 - p[1]) * opened
    tried = s[0] + (step.u - step.u0) / p[2]
    s1[0] = max(min(opened, closing), min(max(opened, closing), tried))
    return p[0] * s1[0]


def flag_shape(p, s, s1, step, past):
    """Elastic up to the activation, with corners; between the two forces along the elastic slope. State: the force."""
    elastic = step.u / p[2]
    opened, closing = max(-1.0, min(1.0, elastic)), max(p[1] - 1.0, min(1.0 - p[1], elastic))
    tried = s[0] + (step.u - step.u0) / p[2]
    s1[0] = max(min(opened, closing), min(max(opened, closing), tried))
    return p[0] * s1[0]


def _length(low, high):
    return lambda rng: 10 ** rng.uniform(math.log10(low), math.log10(high))


SLIP = _length(1e-4, 3e-3)
LAWS = (
    *(
        Law(
            name,
            name.removesuffix("_sharp"),
            "another" if name.endswith("_sharp") else "same",
            advance,
            lambda layer, rng: {
                "fast": layer.peak_force * SHARE,
                "lost": rng.uniform(0.1, 0.8),
                "sharp": 10 ** rng.uniform(0.7, 2.0),
                "length": SLIP(rng),
            },
            ("fast",),
            states=1,
            needs=needs,
        )
        for name, advance, needs in (
            ("friction", friction, ()),
            ("friction_sharp", sharp_friction, ()),
            ("load_friction", load_friction, ("vertical",)),
            ("load_friction_sharp", sharp_load_friction, ("vertical",)),
        )
    ),
    Law(
        "smooth_friction",
        "smooth_friction",
        "same",
        smooth_friction,
        lambda layer, rng: {"sliding": layer.peak_force * SHARE, "slow": 10 ** rng.uniform(-2.7, -1.5)},
        ("sliding",),
    ),
    Law(
        "smooth_friction_exponential",
        "smooth_friction",
        "another",
        exponential_friction,
        lambda layer, rng: {"sliding": layer.peak_force * SHARE, "slow": 10 ** rng.uniform(-2.2, -1.0)},
        ("sliding",),
    ),
    Law(
        "friction_lugre",
        "friction",
        "another",
        lugre_friction,
        lambda layer, rng: {
            "sliding": layer.peak_force * SHARE,
            "sticking": rng.uniform(1.1, 1.6),
            "slow": 10 ** rng.uniform(-2.3, -1.0),
            "length": SLIP(rng),
        },
        ("sliding",),
        states=1,
    ),
    Law(
        "breakaway",
        "breakaway",
        "same",
        breakaway,
        lambda layer, rng: {
            "excess": layer.peak_force * SHARE,
            "slow": 10 ** rng.uniform(-2.0, -1.0),
            "length": SLIP(rng),
        },
        ("excess",),
        states=1,
    ),
    Law(
        "breakaway_slow",
        "breakaway",
        "another",
        slow_breakaway,
        lambda layer, rng: {
            "excess": layer.peak_force * SHARE,
            "slow": 10 ** rng.uniform(-2.0, -1.0),
            "length": SLIP(rng),
        },
        ("excess",),
        states=1,
    ),
    *(
        Law(
            name,
            "second_hysteresis",
            "same" if name == "second_hysteresis" else "another",
            advance,
            lambda layer, rng: {"force": layer.peak_force * 0.1, "length": _length(8e-3, 8e-2)(rng)},
            ("force",),
            states=1,
        )
        for name, advance in (
            ("second_hysteresis", second_hysteresis),
            ("second_hysteresis_bilinear", bilinear_hysteresis),
            ("second_hysteresis_ozdemir", ozdemir_hysteresis),
        )
    ),
    *(
        Law(
            name,
            "sharp_hysteresis",
            "same" if name == "sharp_hysteresis" else "another",
            advance,
            lambda layer, rng: {
                "force": layer.peak_force * 0.1,
                "length": _length(5e-3, 4e-2)(rng),
                "sharpness": _length(3.0, 20.0)(rng),
            },
            ("force",),
            states=states,
        )
        for name, advance, states in (
            ("sharp_hysteresis", sharp_hysteresis, 1),
            ("sharp_hysteresis_menegotto", menegotto_hysteresis, 4),
        )
    ),
    Law(
        "steel_hysteresis",
        "steel_hysteresis",
        "same",
        steel_hysteresis,
        lambda layer, rng: {
            "force": layer.peak_force * 0.1,
            "length": _length(5e-3, 4e-2)(rng),
            "sharpness": rng.uniform(10.0, 25.0),
        },
        ("force",),
        states=7,
    ),
    Law(
        "flag_shape",
        "flag_shape",
        "same",
        flag_shape,
        lambda layer, rng: {
            "activation": layer.peak_force * 0.1,
            "lost": rng.uniform(0.3, 0.9),
            "opening": _length(2e-3, 2e-2)(rng),
        },
        ("activation",),
        states=1,
    ),
    *(
        Law(
            name,
            "self_centring",
            "same" if advance is flag else "another",
            advance,
            lambda layer, rng: {
                "activation": layer.peak_force * 0.1,
                "lost": rng.uniform(0.3, 0.9),
                "opening": _length(2e-3, 2e-2)(rng),
            },
            ("activation",),
            states=1,
        )
        for name, advance in (("self_centring", flag), ("self_centring_sharp", sharp_flag))
    ),
)
