"""Hidden laws of the displacement alone."""

from hidden.law import Law


def hardening(p, s, s1, step, past):
    """`force` at `at`, of which the share `fifth` goes with the fifth power and the rest with the third."""
    x = step.u / p[1]
    return p[0] * x**3 * (1.0 - p[2] + p[2] * x * x)


def moat(p, s, s1, step, past):
    wall, gap = p[0], p[1]
    return wall * (max(step.u - gap, 0.0) + min(step.u + gap, 0.0))


HARDENING = Law(
    "hardening",
    "hardening",
    "same",
    hardening,
    lambda layer, rng: {"force": layer.peak_force * 0.1, "at": layer.peak, "fifth": rng.uniform(0.0, 1.0)},
    ("force",),
)
MOAT = Law(
    "moat",
    "moat",
    "same",
    moat,
    lambda layer, rng: {"wall": layer.k * 2.0, "gap": layer.peak * rng.uniform(0.4, 0.95)},
    ("wall",),
)
LAWS = (HARDENING, MOAT)
