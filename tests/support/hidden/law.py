"""Hidden laws: force of the isolation layer over one step of its motion."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

Need = Literal["cross", "vertical", "temperature"]
"""Motion along the other horizontal axis, vertical motion, temperatures that differ."""


class Step(NamedTuple):
    """Variables of a law in one step and direction; a trailing 0 marks the beginning of the step. SI units."""

    u0: float
    v0: float
    u: float
    v: float
    a: float
    """Relative to the ground, as u and v are."""
    u_cross0: float
    u_cross: float
    v_cross: float
    z0: float
    """Hysteretic variable of the layer's yielding, which lies within ± 1."""
    z: float
    slab0: float
    slab: float
    """m/s², absolute acceleration of the base slab."""
    vertical: float
    """Vertical acceleration of the base slab over that of gravity, upwards."""
    temperature: float
    time: float
    """s since the first earthquake began."""
    index: int
    """Index of the sample at the end of the step, within the earthquake."""
    h: float


@dataclass(frozen=True, slots=True)
class Layer:
    """The isolation layer that a law is added to: its own values, and how far and fast it goes."""

    k: float
    """N/m, after yield."""
    c: float
    """N s/m."""
    F_y: float
    """N."""
    D_y: float
    """m."""
    beta: float
    """Share of the hysteretic softening that is alike on loading and unloading; the rest is the paper's γ."""
    peak: float
    """m, about the largest displacement there will be."""
    speed: float
    """m/s, about the largest velocity."""

    @property
    def peak_force(self) -> float:
        """N, about the largest force there will be."""
        return self.k * self.peak + self.F_y


@dataclass(frozen=True, slots=True)
class Law:
    """A hidden law. It is written as increments over a step, not as rates."""

    name: str
    effect: str
    """Name, in the workbench's library, of the effect that it is or resembles; empty if it resembles none."""
    form: Literal["same", "another", "outside"]
    """Relation to the library: its own law, another of the same family, or of no family in it."""
    advance: Callable[..., float]
    """(p, s, s1, step, past) → force in N, or factor of the yield force: fills s1, the states at the end of the step.

    p: its values in the order of `values`. s: states at the beginning. past: (n,) m, displacements before `step.index`.
    """
    values: Callable[[Layer, np.random.Generator], Mapping[str, float]]
    """Draws its values by name, all of them positive or zero, at some strength."""
    strength: tuple[str, ...]
    """Values that say how strong it is; with all of them at zero the law is absent."""
    states: int = 0
    carried: tuple[int, ...] = ()
    """Places of the states that the layer keeps from one earthquake to the next."""
    fading: Mapping[int, str] | None = None
    """Index of the value with the time constant in s of carried states that decay at rest."""
    limits: Mapping[str, float] | None = None
    """Largest values of strengths that have any."""
    kind: Literal["force", "strength", "yielding"] = "force"
    """Type: adds force, multiplies the yield force, or replaces the layer's yielding."""
    needs: tuple[Need, ...] = ()
    """Conditions that must occur, and be recorded, for the law to show."""
    only_x: bool = False
    """True if it acts along x alone, as a wall on two sides does."""
