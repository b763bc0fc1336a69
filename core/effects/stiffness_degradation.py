"""Yield that loses stiffness, but no strength, with the energy it has dissipated: η = 1 + δ ε of Baber & Wen (1981).

η divides the rate of the hysteretic variable. ε, in m, is the work of the damper's force over F_y.
"""

from core.effect import Effect, LogNormal, Parameter


def law(v, yielded, energy, delta_eta):
    return 1.0 / (1.0 + delta_eta * max(energy, 0.0)), yielded * v


EFFECT = Effect(
    title="Degradation of the initial stiffness alone",
    law=law,
    states=("energy",),
    carried=("energy",),
    acts_on="flow",
    parameters=(
        Parameter("delta_eta", "1/m", (0.0, 1e3), LogNormal(0.5, 1.5), "growth per metre of work over yield force"),
    ),
    absent={"delta_eta": 0.0},
    family="softening with use",
    explanation="The displacement at which the damper yields grows permanently with the energy that it has dissipated: "
    "by the factor 1 + {delta_eta:.3g} per metre of fully yielded travel. The yield force remains.",
    suspect_when="Loops of the same amplitude lean more and more as the motion goes on, with the same height, and stay "
    "so in later earthquakes.",
    source="Baber & Wen (1981): stiffness degradation η",
)
