"""Oil damper with a relief valve, in series with the spring of its brace and of its oil: JSSI (2013).

The state is the common force over the damper's coefficient, a speed. Where the spring would come to its place faster
than steps of a few milliseconds can follow, it does so within SHORTEST, and the force is that of the damper at the
speed that is left to it. This is stable at any stiffness, with an error below 1 % of the force.
"""

from math import copysign

from core.effect import Effect, LogNormal, Parameter

SHORTEST = 4e-3
"""s: a spring that would relax faster takes this long, since steps of a few milliseconds cannot follow it."""


def law(v, spring, coefficient, v_r, left, tau):
    slips = spring + copysign(max(abs(spring) - v_r, 0.0), spring) * (1.0 / left - 1.0)
    away = abs(v - copysign(max(abs(v) - v_r, 0.0), v) * (1.0 - left) - spring)
    rate = (v - slips) / tau
    if abs(rate) * SHORTEST <= away:
        return coefficient * spring, rate
    rate = copysign(away / SHORTEST, rate)
    moved = v - tau * rate
    return coefficient * (moved - copysign(max(abs(moved) - v_r, 0.0), moved) * (1.0 - left)), rate


EFFECT = Effect(
    title="Oil damper with relief, in series with its brace",
    law=law,
    states=("spring",),
    linear=("coefficient",),
    special={"left": 1.0, "tau": 0.0},
    parameters=(
        Parameter("coefficient", "N s/m", (0.0, 1e11), LogNormal(5e6, 1.5), "damping coefficient below relief"),
        Parameter("v_r", "m/s", (1e-3, 5.0), LogNormal(0.1, 1.0), "speed of the damper at which its valve opens"),
        Parameter("left", "1", (1e-3, 1.0), LogNormal(0.1, 0.8), "share of the coefficient that is left beyond relief"),
        Parameter("tau", "s", (1e-6, 10.0), LogNormal(0.05, 1.2), "coefficient over stiffness of brace and oil"),
    ),
    absent={"coefficient": 0.0},
    family="nonlinear viscosity",
    explanation="An oil damper with {coefficient} opens its valve at {v_r}; beyond it, a share of {left:.2f} of the "
    "coefficient is left. With the spring of its brace it relaxes in {tau}.",
    suspect_when="A flat-topped loop leans: after each reversal the force builds up like that of a spring.",
    source="JSSI manual of passive control (2013): Maxwell model of a bilinear oil damper with its brace",
)
