"""Hidden laws of what the layer went through before: the largest displacement, the work, its heat."""

import math

from hidden.law import Law


def mullins(p, s, s1, step, past):
    """State: largest past displacement."""
    s1[0] = max(s[0], abs(step.u))
    return p[0] * math.exp(-s1[0] / p[1]) * step.u


def heating(p, s, s1, step, past):
    """State: warming, in units of that which weakens the core by e. Work per yield force: z du."""
    s1[0] = s[0] * math.exp(-step.h / p[1]) + 0.5 * (step.z0 + step.z) * (step.u - step.u0) * p[0]
    return math.exp(-s1[0])


MULLINS = Law(
    "mullins",
    "mullins",
    "same",
    mullins,
    lambda layer, rng: {"stiffness": layer.k * 0.5, "length": layer.peak * 10 ** rng.uniform(-1.1, -0.1)},
    ("stiffness",),
    states=1,
    carried=(0,),
)
HEATING = Law(
    "heating",
    "heating",
    "same",
    heating,
    lambda layer, rng: {"warmed": 10 ** rng.uniform(-1.0, 0.0), "lasting": 10 ** rng.uniform(0.7, 2.5)},
    ("warmed",),
    states=1,
    carried=(0,),
    fading={0: "lasting"},
    limits={"warmed": 30.0},
    kind="strength",
)
LAWS = (MULLINS, HEATING)
