"""Power-law damper in series with the spring of its brace: a nonlinear Maxwell element.

The state is the common force over `force`. Where the spring would come to its place faster than steps of a few
milliseconds can follow, it does so within SHORTEST, and the force is that of the damper at the speed that is left to
it. This is stable at any stiffness. The error is the product of two small numbers, the share of the motion that the
spring takes and the delay of that share: below 1 % of the force for exponents from 0.3 on.
"""

from math import copysign

from core.effect import Effect, LogNormal, Parameter

LINEAR_BELOW = 1e-6
"""Share of the reference speed, or force, below which the damper is linear, as its slope would be infinite. Not
tuned."""
SHORTEST = 4e-3
"""s: a spring that would relax faster takes this long, since steps of a few milliseconds cannot follow it. The tangent
of its relaxation is no steeper either: above an exponent of 1, the damper's speed is a root of its force, and straight
where that is steeper."""


def law(v, spring, force, exponent, speed, give):
    slips = speed * spring * max(abs(spring), LINEAR_BELOW) ** (1.0 / exponent - 1.0)
    ratio = v / speed
    away = abs(ratio * max(abs(ratio), LINEAR_BELOW) ** (exponent - 1.0) - spring)
    rate = (v - slips) / give
    if abs(rate) * SHORTEST <= away:
        steepest = SHORTEST * speed / (give * exponent)
        if exponent > 1.0 and max(abs(spring), LINEAR_BELOW) ** (1.0 - 1.0 / exponent) < steepest:
            straight = copysign(steepest ** (1.0 / (exponent - 1.0)) * (1.0 - 1.0 / exponent), spring)
            steady = abs((v - speed * straight) / give - spring / SHORTEST)
            rate = copysign(min(steady, away / SHORTEST), rate)
        return force * spring, rate
    rate = copysign(away / SHORTEST, rate)
    ratio = (v - give * rate) / speed
    return force * ratio * max(abs(ratio), LINEAR_BELOW) ** (exponent - 1.0), rate


EFFECT = Effect(
    title="Power-law damper in series with its brace",
    law=law,
    states=("spring",),
    linear=("force",),
    special={"exponent": 1.0, "give": 0.0},
    held=("speed",),  # a reference value: force and exponent describe the damper
    parameters=(
        Parameter("force", "N", (0.0, 1e11), LogNormal(1e6, 1.5), "force at the reference speed"),
        Parameter("exponent", "1", (0.1, 3.0), LogNormal(0.5, 0.7), "power of the damper's speed"),
        Parameter("speed", "m/s", (1e-3, 10.0), LogNormal(0.1, 1.0), "reference speed"),
        Parameter("give", "m", (1e-7, 0.5), LogNormal(5e-3, 1.2), "displacement of the brace under that force"),
    ),
    absent={"force": 0.0},
    family="nonlinear viscosity",
    explanation="A damper has a force of {force} at {speed}, which grows with its speed to the power {exponent:.2f}. "
    "It stands in series with a brace that gives by {give} under this force.",
    suspect_when="The force of a damper lags behind the velocity, and builds up like that of a spring after each "
    "reversal.",
    source="Lin & Chopra (2003): nonlinear viscous damper with a flexible brace; Maxwell (1867) for a power of 1",
)
