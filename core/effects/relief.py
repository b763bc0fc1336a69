"""Relief valve of an oil damper: beyond a speed its force grows more slowly. JSSI (2013), bilinear oil damper."""

from core.effect import Effect, LogNormal, Parameter


def law(v, relieved, v_r):
    return relieved * (min(v_r - v, 0.0) + max(-v_r - v, 0.0))


EFFECT = Effect(
    title="Relief of the oil damper",
    law=law,
    linear=("relieved",),
    parameters=(
        Parameter("relieved", "N s/m", (0.0, 1e11), LogNormal(3e6, 1.5), "damping coefficient lost beyond relief"),
        Parameter("v_r", "m/s", (1e-3, 5.0), LogNormal(0.1, 1.0), "speed at which the valve opens"),
    ),
    absent={"relieved": 0.0},
    family="nonlinear viscosity",
    explanation="Above {v_r} a valve opens, and the damping coefficient falls by {relieved}.",
    suspect_when="The loop is an ellipse in slow motion, and has a flat top and bottom in fast motion.",
    source="JSSI manual of passive control (2013): bilinear oil damper; a dashpot must remain, c - D >= 0",
)
