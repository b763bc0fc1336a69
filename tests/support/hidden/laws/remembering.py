"""Hidden laws of what the layer went through, and of what changes the damper's strength."""

import math

from hidden.law import Law
from hidden.laws.elastic import DAY


def mullins(p, s, s1, step, past):
    """State: largest past displacement."""
    s1[0] = max(s[0], abs(step.u))
    return p[0] * math.exp(-s1[0] / p[1]) * step.u


def power_mullins(p, s, s1, step, past):
    """Softening as a power of the largest past displacement, in the manner of Ogden and Roxburgh (1999)."""
    s1[0] = max(s[0], abs(step.u))
    return p[0] * (1.0 + s1[0] / p[1]) ** -p[2] * step.u


def wear(p, s, s1, step, past):
    """Strength lost exponentially with work (Sivaselvan and Reinhorn, 2000). State: work per yield force, m."""
    s1[0] = s[0] + max(0.5 * (step.z0 + step.z) * (step.u - step.u0), 0.0)
    return math.exp(-p[0] * s1[0])


def heating(p, s, s1, step, past):
    """State: warming, in units of that which weakens the core by e. Work per yield force: z du."""
    s1[0] = s[0] * math.exp(-step.h / p[1]) + 0.5 * (step.z0 + step.z) * (step.u - step.u0) * p[0]
    return math.exp(-s1[0])


def heating_by_both(p, s, s1, step, past):
    """States: warming, as above, by work along both axes; z along the other axis, on a circle with the layer's own."""
    along, across = 0.5 * (step.z0 + step.z) * (step.u - step.u0), (step.u_cross - step.u_cross0)
    pieces = 1 + int(abs(across) / (0.05 * p[2]))
    z, work, piece = s[1], max(along, 0.0) / pieces, across / pieces
    spent = along
    for _ in range(pieces):
        middle = z
        for part in (0.5, 1.0):
            middle = z + part * (piece - middle * (max(piece * middle, 0.0) + work)) / p[2]
        spent += 0.5 * (z + middle) * piece
        z = middle
    s1[0], s1[1] = s[0] * math.exp(-step.h / p[1]) + spent * p[0], z
    return math.exp(-s1[0])


def pendulum(p, s, s1, step, past):
    """Ripples of a pendulum's stiffness under the vertical load; the layer's own stiffness is that under dead load."""
    return p[0] * p[1] * step.vertical * step.u


def by_rate(p, s, s1, step, past):
    """Strength that grows as a power of the speed, as that of lead (Robinson, 1982)."""
    return (1.0 + (step.v / p[1]) ** 2) ** (0.5 * p[0])


def by_rate_logarithm(p, s, s1, step, past):
    """Strength that grows with the logarithm of the speed, as thermally activated flow does (Eyring, 1936)."""
    return 1.0 + p[0] * math.log1p(abs(step.v) / p[1])


def strength_step(p, s, s1, step, past):
    """A share of the strength is lost within about two seconds of a date."""
    return 1.0 - p[0] * 0.5 * (1.0 + math.tanh((step.time - p[1]) / 2.0))


def reciprocal_heating(p, s, s1, step, past):
    """Strength 1 / (1 + T), the heat that of the core as weak as it is."""
    weak = 1.0 / (1.0 + max(s[0], 0.0))
    s1[0] = s[0] * math.exp(-step.h / p[1]) + 0.5 * (step.z0 + step.z) * (step.u - step.u0) * p[0] * weak
    return 1.0 / (1.0 + max(s1[0], 0.0))


def vertical(p, s, s1, step, past):
    return 1.0 + p[0] * step.vertical


def vertical_friction(p, s, s1, step, past):
    """Sliding friction under a load that changes; what it has under dead load is the damper's. State: elastic slip."""
    travel = (step.u - step.u0) / p[1]
    sign = 1.0 if travel >= 0 else -1.0
    s1[0] = sign + (s[0] - sign) * math.exp(-abs(travel))
    return p[0] * step.vertical * s1[0]


def temperature_strength(p, s, s1, step, past):
    return math.exp(p[0] * (20.0 - step.temperature))


def temperature_strength_straight(p, s, s1, step, past):
    return max(1.0 + p[0] * (20.0 - step.temperature), 0.05)


def _heated(layer, rng):
    return {"warmed": 10 ** rng.uniform(-1.0, 0.0), "lasting": 10 ** rng.uniform(0.7, 2.5)}


LAWS = (
    Law(
        "mullins",
        "mullins",
        "same",
        mullins,
        lambda layer, rng: {"stiffness": layer.k * 0.5, "length": layer.peak * 10 ** rng.uniform(-1.1, 0.0)},
        ("stiffness",),
        states=1,
        carried=(0,),
    ),
    Law(
        "mullins_power",
        "mullins",
        "another",
        power_mullins,
        lambda layer, rng: {
            "stiffness": layer.k * 0.5,
            "length": layer.peak * 10 ** rng.uniform(-1.1, -0.3),
            "power": rng.uniform(0.7, 2.0),
        },
        ("stiffness",),
        states=1,
        carried=(0,),
    ),
    Law(
        "rate_strengthening",
        "rate_strengthening",
        "same",
        by_rate,
        lambda layer, rng: {"power": rng.uniform(0.05, 0.3), "slow": 10 ** rng.uniform(-3.0, -1.5)},
        ("power",),
        limits={"power": 0.6},
        kind="strength",
    ),
    Law(
        "rate_strengthening_logarithmic",
        "rate_strengthening",
        "another",
        by_rate_logarithm,
        lambda layer, rng: {"growth": rng.uniform(0.03, 0.2), "slow": 10 ** rng.uniform(-3.0, -1.5)},
        ("growth",),
        limits={"growth": 2.0},
        kind="strength",
    ),
    Law(
        "degradation_exponential",
        "degradation",
        "another",
        wear,
        lambda layer, rng: {"wear": rng.uniform(0.05, 0.5)},
        ("wear",),
        states=1,
        carried=(0,),
        limits={"wear": 5.0},
        kind="strength",
    ),
    *(
        Law(
            name,
            "heating",
            "same" if advance is heating else "another",
            advance,
            _heated,
            ("warmed",),
            states=1,
            carried=(0,),
            fading={0: "lasting"},
            limits={"warmed": 30.0},
            kind="strength",
        )
        for name, advance in (("heating", heating), ("heating_reciprocal", reciprocal_heating))
    ),
    Law(
        "heating_by_both",
        "biaxial_heating",
        "same",
        heating_by_both,
        lambda layer, rng: _heated(layer, rng) | {"D_lead": 5e-3},
        ("warmed",),
        states=2,
        carried=(0,),
        fading={0: "lasting"},
        limits={"warmed": 30.0},
        kind="strength",
        needs=("cross",),
    ),
    Law(
        "strength_step",
        "strength_step",
        "same",
        strength_step,
        lambda layer, rng: {"lost": 0.2, "date": rng.uniform(25 * DAY, 115 * DAY)},
        ("lost",),
        limits={"lost": 0.8},
        kind="strength",
    ),
    Law(
        "vertical_load",
        "vertical_load",
        "same",
        vertical,
        lambda layer, rng: {"share": 1.0},
        ("share",),
        limits={"share": 4.0},
        kind="strength",
        needs=("vertical",),
    ),
    Law(
        "pendulum",
        "pendulum",
        "same",
        pendulum,
        lambda layer, rng: {"share": rng.uniform(0.3, 1.0), "k": layer.k},
        ("share",),
        limits={"share": 1.0},
        needs=("vertical",),
    ),
    Law(
        "vertical_load_friction",
        "load_friction",
        "another",
        vertical_friction,
        lambda layer, rng: {"sliding": layer.peak_force * 0.1, "length": 10 ** rng.uniform(-4.0, -2.7)},
        ("sliding",),
        states=1,
        needs=("vertical",),
    ),
    *(
        Law(
            name,
            "temperature_strength",
            "same" if advance is temperature_strength else "another",
            advance,
            lambda layer, rng: {"share": 0.01},
            ("share",),
            limits={"share": 0.04},
            kind="strength",
            needs=("temperature",),
        )
        for name, advance in (
            ("temperature_strength", temperature_strength),
            ("temperature_strength_straight", temperature_strength_straight),
        )
    ),
)
