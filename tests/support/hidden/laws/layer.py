"""The yielding damper that every layer has, besides rubber and dashpot, where no hidden form of it takes its place."""

import math

from numba import njit

from hidden.law import Law


@njit
def z_after_travel(z, travel, beta):
    """z after a monotonic travel in yield displacements (Wen, 1976, n = 1, A = 1): dw/dξ = 1 − (1 − β) w − β |w|.

    w is z in the direction of travel. Below zero that is 1 − (1 − 2β) w, above it 1 − w.
    """
    sign = 1.0 if travel >= 0 else -1.0
    left, w = abs(travel), sign * z
    if w < 0:
        rate = 1.0 - 2.0 * beta
        straight = abs(rate) < 1e-9
        to_zero = -w if straight else math.log1p(-rate * w) / rate
        if to_zero >= left:
            return sign * (w + left if straight else w * math.exp(-rate * left) - math.expm1(-rate * left) / rate)
        left -= to_zero
        w = 0.0
    return sign * (w - (1.0 - w) * math.expm1(-left))


def yielding(p, s, s1, step, past):
    F_y, D_y, beta = p[0], p[1], p[2]
    s1[0] = z_after_travel(s[0], (step.u - step.u0) / D_y, beta)
    return F_y * s1[0]


YIELDING = Law(
    "yielding",
    "bouc_wen",
    "same",
    yielding,
    values=lambda layer, rng: {"F_y": layer.F_y, "D_y": layer.D_y, "beta": layer.beta},
    strength=("F_y",),
    states=1,
    kind="yielding",
)
LAWS = (YIELDING,)
