"""Yield that loses strength, but no stiffness, with the energy it has dissipated: ν = 1 + δ ε of Baber & Wen (1981).

ν scales the plastic flow, so that the hysteretic variable is bounded by (A / (ν (β + γ)))^(1/n). ε, in m, is the work
of the damper's force over F_y.
"""

from core.effect import Effect, LogNormal, Parameter


def law(v, yielded, energy, delta_nu):
    return 1.0 + delta_nu * max(energy, 0.0), yielded * v


EFFECT = Effect(
    title="Degradation of the yield force alone",
    law=law,
    states=("energy",),
    carried=("energy",),
    acts_on="plasticity",
    parameters=(
        Parameter("delta_nu", "1/m", (0.0, 100.0), LogNormal(0.1, 1.5), "loss per metre of work over yield force"),
    ),
    absent={"delta_nu": 0.0},
    family="softening with use",
    explanation="The yield force falls permanently with the energy that the damper has dissipated: by the factor "
    "1 / (1 + {delta_nu:.3g} per metre of fully yielded travel). The stiffness before yielding remains.",
    suspect_when="Loops of the same amplitude become lower as the motion goes on, with the same slope after each "
    "reversal, and stay so in later earthquakes.",
    source="Baber & Wen (1981): strength degradation ν",
)
