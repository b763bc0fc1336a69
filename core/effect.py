"""What an isolator effect is: a law, its parameters and what it means."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from inspect import signature
from math import log
from types import MappingProxyType
from typing import Literal

from core.errors import ModelError

MOTION = ("u", "v", "u_cross", "v_cross")
"""m and m/s, across the isolator in the direction of the force, and in the other horizontal one."""

CONDITIONS = ("axial_load", "temperature", "time")
"""Vertical force / weight at rest; °C; s since the start of the record."""

SCALES = ("stiffness", "strength")
"""Dimensionless, 1 when intact: set by effects that act on them, read by the others."""


@dataclass(frozen=True, slots=True)
class LogNormal:
    """Prior of a positive parameter: its median, and the spread of its logarithm."""

    median: float
    spread: float

    def residual(self, value: float) -> float:
        """Standardised distance, so that least squares adds it to the misfit."""
        return log(value / self.median) / self.spread


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number an effect is fitted with, in SI units."""

    name: str
    unit: str
    bounds: tuple[float, float]
    prior: LogNormal
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """A physical effect. Its law's arguments say what it needs, by name."""

    title: str
    law: Callable[..., float | tuple[float, ...]]
    """Force, or scale, and after it the rate of each state per second."""
    parameters: tuple[Parameter, ...]
    absent: Mapping[str, float]
    """Values of parameters at which the effect does nothing at all."""
    family: str
    """Effects of one family leave alike traces, and records may not tell them apart."""
    explanation: str
    """A sentence for the engineer, with the parameters' values in it."""
    suspect_when: str
    """What in the measurements makes one think of it."""
    source: str
    """Author, year, equation."""
    states: tuple[str, ...] = ()
    acts_on: Literal["force", "stiffness", "strength"] = "force"
    needs: tuple[str, ...] = field(init=False)
    """Names of the law's arguments, in order."""

    def __post_init__(self) -> None:
        needs = tuple(signature(self.law).parameters)
        offered = (*MOTION, *CONDITIONS, *SCALES, *self.states, *(p.name for p in self.parameters))
        if unknown := sorted(set(needs) - set(offered)):
            raise ModelError(f"{self.title}: the law asks for {unknown}, offered are {sorted(offered)}")
        if len(set(offered)) < len(offered):
            raise ModelError(f"{self.title}: a state or parameter takes the name of another offer, in {offered}")
        object.__setattr__(self, "needs", needs)
        object.__setattr__(self, "absent", MappingProxyType(dict(self.absent)))
