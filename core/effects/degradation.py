"""Yield that weakens with the energy it has dissipated: Baber & Wen (1981) with ν = η = 1 + δ ε.

Together they scale the slope of the hysteretic variable. ε, in m, is the work of its force over F_y.
"""

from core.effect import Effect, LogNormal, Parameter


def law(v, yielded, energy, delta):
    return 1.0 / (1.0 + delta * max(energy, 0.0)), yielded * v


EFFECT = Effect(
    title="Degradation of the yield",
    law=law,
    states=("energy",),
    carried=("energy",),
    acts_on="slope",
    parameters=(
        Parameter("delta", "1/m", (0.0, 100.0), LogNormal(0.1, 1.5), "loss per metre of work over yield force"),
    ),
    absent={"delta": 0.0},
    family="softening with use",
    explanation="The damper weakens permanently with the energy it has dissipated: by the factor 1 / (1 + {delta:.3g} "
    "per metre of fully yielded travel).",
    suspect_when="Loops of the same amplitude become lower and less steep as the motion goes on, and stay so in later "
    "earthquakes.",
    source="Baber & Wen (1981): degradation by dissipated energy",
)
