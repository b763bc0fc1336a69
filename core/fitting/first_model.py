"""With which model of its isolation layer does a building begin?"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import pi

from core.description import BuildingDescription, IsolationDesign
from core.effects import EFFECTS
from core.model.isolator import Isolator
from core.paper import ISOLATOR

PERIOD = 3.0
"""s, of a usual building on its isolators."""
DAMPING_RATIO = 0.1
"""Of the same."""


@dataclass(frozen=True, slots=True)
class FirstModel:
    """A model before anything was fitted."""

    isolator: Isolator
    assumed: tuple[str, ...]
    """Parameters that the design does not give and that only make a start: they must be fitted to records."""


def first_model(description: BuildingDescription) -> FirstModel:
    """The paper's model with the building's design values: elastic, viscous and, if the yield force is given, yielding.

    Where the design gives no stiffness or damping, a usual period and damping ratio make a start from the mass.
    """
    given = {name: value for name, value in asdict(description.isolation.design).items() if value is not None}
    values = asdict(replace(usual_design(description), **given))
    effects = {name: _values(name, values) for name in ISOLATOR.effects if _is_given(name, values)}
    used = {parameter for chosen in effects.values() for parameter in chosen if parameter in values}
    return FirstModel(Isolator(effects), tuple(sorted(used - set(given))))


def usual_design(description: BuildingDescription) -> IsolationDesign:
    """A linear layer on which the whole building has PERIOD and DAMPING_RATIO, to three digits."""
    mass, frequency = description.base_mass + float(description.floor_mass.sum()), 2 * pi / PERIOD
    k_b, c_b = mass * frequency**2, 2 * DAMPING_RATIO * mass * frequency
    return IsolationDesign(k_b=float(f"{k_b:.3g}"), c_b=float(f"{c_b:.3g}"))


def _is_given(name: str, values: Mapping[str, float | None]) -> bool:
    """Whether what the effect is proportional to has a value."""
    return all(values[parameter] is not None for parameter in EFFECTS[name].linear)


def _values(name: str, values: Mapping[str, float | None]) -> dict[str, float]:
    """Of every parameter: the design's, else a usual one."""
    return {
        parameter.name: parameter.prior.median if (value := values.get(parameter.name)) is None else value
        for parameter in EFFECTS[name].parameters
    }
