"""Definition of an isolator effect: its law, its parameters and its meaning."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from inspect import signature
from math import log
from types import MappingProxyType
from typing import Any

from core.errors import ModelError
from core.frozen import FrozenDict
from core.rounding import plain
from core.units import shown, unit

MOTION = ("u", "v", "u_cross", "v_cross")
"""m and m/s, across the isolator in the direction of the force, and in the other horizontal one."""

CONDITIONS = ("axial_load", "temperature", "time", "ground")
"""Vertical force / weight at rest; °C; s since the model's reference instant; m/s², acceleration of the ground."""


STEP = "step"
"""s, of the integration: a law that comes to its bound at once does so within a share of it."""


@dataclass(frozen=True, slots=True)
class Channel:
    """Channels that laws share: each law adds to its channel, or multiplies it."""

    neutral: float
    """Its value where no effect acts on it: 0 is added to, 1 is multiplied."""
    meaning: str


CHANNELS: Mapping[str, Channel] = MappingProxyType(
    {
        "force": Channel(0.0, "N, of the layer"),
        "inertance": Channel(0.0, "kg, force per unit relative acceleration of the layer"),
        "stiffness": Channel(1.0, "scale of rubber forces"),
        "strength": Channel(1.0, "scale of yielding forces"),
        "softening": Channel(1.0, "scale of the rubber's elastic forces by past displacements"),
        "growth": Channel(1.0, "scale of the bound of hysteretic variables"),
        "relaxing": Channel(0.0, "1/s, rate at which hysteretic variables fade"),
        "load": Channel(1.0, "scale of yielding and sliding forces alike"),
        "sharpness": Channel(1.0, "scale of the exponent of the yield"),
        "slope": Channel(1.0, "scale of the hysteresis' initial slope"),
        "plasticity": Channel(1.0, "scale of the hysteresis' plastic flow"),
        "flow": Channel(1.0, "scale of the rate of the hysteretic variable"),
        "cross_flow": Channel(0.0, "m/s, plastic flow that the motion in the other direction adds"),
    }
)
"""By name; SI."""

RESULTS = ("force", "inertance")
"""Channels that make up the layer's answer. The others are set by effects that act on them and read by laws."""
SCALES = tuple(name for name in CHANNELS if name not in RESULTS)
"""Channels through which laws change each other."""
KINDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"rubber": ("stiffness",), "yielding": ("strength", "load"), "sliding": ("load",)}
)
"""Kinds of force, each with the scales that multiply it: of rubber, its own hysteresis included; of dampers that yield,
such as lead; of surfaces that slide. An effect on temperature, load or age thus acts on every force of a kind."""
YIELDED = "yielded"
"""Name under which every law may read the hysteretic variable of the effect that publishes one; 0 if none does."""
PLACE = re.compile(r"\{(\w+)[^}]*\}")
"""A parameter's place in an explanation."""
DIGITS = 3
"""Digits of a value in an explanation: its uncertainty is not known there."""


@dataclass(frozen=True, slots=True)
class LogNormal:
    """Prior of a positive parameter: its median, and the spread of its logarithm."""

    median: float
    spread: float

    def residual(self, value: float) -> float:
        """Standardised distance, so that least squares adds it to the misfit."""
        return log(value / self.median) / self.spread


@dataclass(frozen=True, slots=True)
class Normal:
    """Prior of a parameter of either sign: its median, and its standard deviation."""

    median: float
    spread: float

    def residual(self, value: float) -> float:
        """Standardised distance, so that least squares adds it to the misfit."""
        return (value - self.median) / self.spread


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number an effect is fitted with, in SI units."""

    name: str
    unit: str
    bounds: tuple[float, float]
    prior: LogNormal | Normal
    """Its median is a usual value at which the effect is present."""
    meaning: str

    @property
    def is_instant(self) -> bool:
        """True if it is a time after the model's reference instant, not a duration."""
        return self.unit == "s" and self.bounds[0] < 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Effect:
    """A physical effect. Its law's arguments name what it needs."""

    title: str
    law: Callable[..., float | tuple[float, ...]]
    """Law: its result for the channel that it acts on, then the rate of each state per second."""
    parameters: tuple[Parameter, ...]
    absent: Mapping[str, float]
    """Values of parameters at which the effect does nothing at all."""
    family: str
    """Effects of one family leave similar traces, and records may not distinguish them."""
    explanation: str
    """A sentence for the engineer, with the parameters' values in it: {F_y} for one with its unit as engineers read it,
    {share:.2f} for the SI number alone."""
    suspect_when: str
    """Observation that suggests the effect."""
    source: str
    """Author, year, equation."""
    states: tuple[str, ...] = ()
    acts_on: str = "force"
    """One of CHANNELS."""
    kind: str | None = None
    """One of KINDS, whose scales multiply what the law returns; None for a force that nothing scales."""
    linear: tuple[str, ...] = ()
    """Parameters that what it does is proportional to, all of them together; no state depends on them."""
    held: tuple[str, ...] = ()
    """Parameters that a fit keeps fixed, since other parameters have the same effect."""
    forms: Mapping[str, tuple[float, ...]] = field(default_factory=FrozenDict)
    """Parameters that choose the form of the law, with their values in other published forms than the usual one, which
    the median of the prior chooses. A fit keeps them fixed; a diagnosis tries the other forms."""
    special: Mapping[str, float] = field(default_factory=FrozenDict)
    """Values of parameters at which the law is a simpler one, such as that of another effect."""
    open_ended: tuple[str, ...] = ()
    """Parameters whose largest value stands for all that are larger, such as a sharpness."""
    carried: tuple[str, ...] = ()
    """States that the layer keeps from one earthquake to the next; the others begin each at zero."""
    design: Mapping[str, Callable[..., Any]] = field(default_factory=FrozenDict)
    """Design values that follow from the effect's parameters, by their names in core.description.IsolationDesign:
    functions of parameters, by name, which also accept complex numbers for the sake of derivatives."""
    publishes: str | None = None
    """State that other laws read as `yielded`; one effect has it."""
    sets_in: str | None = None
    """Parameter with the duration of a change at an instant; a search moves the instant by steps of that order."""
    needs: tuple[str, ...] = field(init=False)
    """Names of the law's arguments, in order."""

    def __post_init__(self) -> None:
        needs = tuple(signature(self.law).parameters)
        named = tuple(parameter.name for parameter in self.parameters)
        offered = (*MOTION, *CONDITIONS, STEP, *SCALES, YIELDED, *self.states, *named)
        if unknown := sorted(set(needs) - set(offered)):
            raise ModelError(f"{self.title}: the law needs {unknown}; available are {sorted(offered)}")
        if len(set(offered)) < len(offered):
            raise ModelError(f"{self.title}: a state or parameter takes the name of another offer, in {offered}")
        if self.acts_on not in CHANNELS:
            raise ModelError(f"{self.title}: acts on {self.acts_on!r}; it must act on one of {', '.join(CHANNELS)}")
        if self.kind is not None:
            self._check_kind(self.kind, needs)
        of_design = {name for value in self.design.values() for name in signature(value).parameters}
        chosen = {*self.absent, *self.linear, *self.held, *self.forms, *self.special, *self.open_ended, *of_design}
        if strange := sorted({*chosen, *filter(None, [self.sets_in])} - set(named)):
            raise ModelError(f"{self.title}: {strange} are no parameters of its own; those are {sorted(named)}")
        kept = {*self.carried, *([self.publishes] if self.publishes else [])}
        if strange := sorted(kept - set(self.states)):
            raise ModelError(f"{self.title}: {strange} are no states of its own; those are {sorted(self.states)}")
        object.__setattr__(self, "needs", needs)
        object.__setattr__(self, "held", tuple(dict.fromkeys((*self.held, *self.forms))))
        object.__setattr__(self, "absent", FrozenDict(self.absent))
        object.__setattr__(self, "forms", FrozenDict(self.forms))
        object.__setattr__(self, "special", FrozenDict(self.special))
        object.__setattr__(self, "design", FrozenDict(self.design))

    @property
    def fitted(self) -> tuple[str, ...]:
        """Parameters that a fit does not keep fixed."""
        return tuple(one.name for one in self.parameters if one.name not in self.held)

    def _check_kind(self, kind: str, needs: tuple[str, ...]) -> None:
        if kind not in KINDS:
            raise ModelError(f"{self.title}: its kind {kind!r} must be one of {', '.join(KINDS)}")
        if self.acts_on != "force":
            raise ModelError(f"{self.title}: it acts on {self.acts_on!r}; only a force has a kind")
        if twice := sorted(set(needs) & set(KINDS[kind])):
            raise ModelError(
                f"{self.title}: a force of the kind {kind!r} is multiplied by {twice}; leave it to the kind"
            )


@dataclass(frozen=True, slots=True)
class Quantity:
    """A parameter's value in an explanation: in the unit that engineers read, or by a format the SI number alone."""

    value: float
    unit: str
    """SI."""
    words: str = ""
    """Words in its place; empty for the value."""

    def __format__(self, form: str) -> str:
        if form:
            return format(self.value, form)
        return self.words or f"{plain(shown(self.value, self.unit), DIGITS)} {unit(self.unit)}".rstrip()


def explained(effect: Effect, values: Mapping[str, float] | None, instant: Callable[[float], str] | None = None) -> str:
    """Explanation of an effect with the values of a model; with the parameters' names if there is none.

    Args:
        effect: whose explanation has places for its values.
        values: SI units, by parameter; None if there are none.
        instant: words for an instant, s after the model's reference instant; None where its date is not known: then the
            seconds are said.
    """
    if values is None:
        return PLACE.sub(r"\1", effect.explanation)
    dated = (
        {} if instant is None else {one.name: instant(values[one.name]) for one in effect.parameters if one.is_instant}
    )
    said = {one.name: Quantity(values[one.name], one.unit, dated.get(one.name, "")) for one in effect.parameters}
    return effect.explanation.format(**said)
