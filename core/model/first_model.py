"""The isolation layer's model that follows from a building's design values."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from math import pi

from core.description import BuildingDescription, IsolationDesign
from core.effects import EFFECTS
from core.model.isolator import Isolator

PERIOD = 3.0
"""s, natural period of a usual building on its isolators."""
DAMPING_RATIO = 0.1
"""Damping ratio of the same building."""


@dataclass(frozen=True, slots=True)
class FirstModel:
    """A model at design values, before any fit."""

    isolator: Isolator
    assumed: tuple[str, ...]
    """Parameters that the design does not give, at usual values from which a fit can start."""

    def __str__(self) -> str:
        assumed = f"The design does not give {', '.join(self.assumed)}: usual values." if self.assumed else ""
        return f"{self.isolator}\n\n{assumed or 'The design gives all values.'}"


def first_model(description: BuildingDescription) -> FirstModel:
    """The effects that the design gives: elastic and viscous, and Bouc-Wen hysteresis if a yield force is given.

    Stiffness and damping that the design does not give follow from the mass, by a usual period and damping ratio.
    """
    given = {name: value for name, value in asdict(description.isolation.design).items() if value is not None}
    values = asdict(replace(usual_design(description), **given))
    effects = {name: _values(name, values) for name in _design_effects() if _is_given(name, values)}
    used = {parameter for chosen in effects.values() for parameter in chosen if parameter in values}
    return FirstModel(Isolator(effects), tuple(sorted(used - set(given))))


def usual_design(description: BuildingDescription) -> IsolationDesign:
    """A linear layer on which the whole building has PERIOD and DAMPING_RATIO, to three digits."""
    mass, frequency = description.base_mass + float(description.floor_mass.sum()), 2 * pi / PERIOD
    k_b, c_b = mass * frequency**2, 2 * DAMPING_RATIO * mass * frequency
    return IsolationDesign(k_b=float(f"{k_b:.3g}"), c_b=float(f"{c_b:.3g}"))


def _design_effects() -> tuple[str, ...]:
    """Effects that have design values, in the order of the design."""
    values = [value.name for value in fields(IsolationDesign)]
    return tuple(dict.fromkeys(name for value in values for name, effect in EFFECTS.items() if value in effect.design))


def _is_given(name: str, values: Mapping[str, float | None]) -> bool:
    """True if all parameters that the effect is proportional to have a value."""
    return all(values.get(parameter) is not None for parameter in EFFECTS[name].linear)


def _values(name: str, values: Mapping[str, float | None]) -> dict[str, float]:
    """Values of all parameters: the design's, else the medians of their priors."""
    return {
        parameter.name: parameter.prior.median if (value := values.get(parameter.name)) is None else value
        for parameter in EFFECTS[name].parameters
    }
