"""Which quantities are watched for drift, and what is known of each before anything was measured?"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from core.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """How one kind of quantity behaves in a healthy building."""

    name: str
    title: str
    """For people, as in "stiffness of the isolation layer"."""
    is_logarithmic: bool
    """Whether its relative changes are watched; else its changes in SI units."""
    follows_amplitude: bool
    follows_temperature: bool
    harm: Literal["less", "more", "either"]
    """The change that is one for the worse."""
    scatter: float
    """Typical standard deviation from one healthy event to another beside all that is known; relative, or SI units."""
    own_scatter: float
    """The same from one observation to another within an event, beside their own standard deviations."""
    softening: float = 0.0
    """Standard deviation of what comes back after an earthquake larger than all before, for each unit of the natural
    logarithm by which it was larger; relative."""
    per_kelvin: tuple[float, float] = (0.0, 0.0)
    """Mean and standard deviation, among buildings, of the change with one kelvin; relative."""


_every = (
    Quantity(
        name="stiffness",
        title="stiffness of the isolation layer",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=True,
        harm="less",
        scatter=0.01,
        own_scatter=0.01,
        softening=0.015,
        per_kelvin=(-0.004, 0.004),
    ),
    Quantity(
        name="damping",
        title="damping of the isolation layer",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=True,
        harm="less",
        scatter=0.03,
        own_scatter=0.05,
        softening=0.015,
        per_kelvin=(-0.004, 0.006),
    ),
    Quantity(
        name="frequency",
        title="natural frequency of the superstructure",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=True,
        harm="less",
        scatter=0.01,
        own_scatter=0.01,
        per_kelvin=(0.0, 0.001),
    ),
    Quantity(
        name="gain",
        title="gain of a sensor against its neighbours",
        is_logarithmic=True,
        follows_amplitude=False,
        follows_temperature=False,
        harm="either",
        scatter=0.005,
        own_scatter=0.005,
    ),
    Quantity(
        name="noise",
        title="noise floor of a sensor",
        is_logarithmic=True,
        follows_amplitude=False,
        follows_temperature=False,
        harm="more",
        scatter=0.2,
        own_scatter=0.1,
    ),
    Quantity(
        name="residual_displacement",
        title="displacement at which the isolation layer rests",
        is_logarithmic=False,
        follows_amplitude=False,
        follows_temperature=False,
        harm="either",
        scatter=5e-4,
        own_scatter=1e-4,
    ),
    Quantity(
        name="model_error",
        title="error of the isolator model",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=False,
        harm="more",
        scatter=0.1,
        own_scatter=0.1,
    ),
)

QUANTITIES: Mapping[str, Quantity] = MappingProxyType({quantity.name: quantity for quantity in _every})


def quantity(name: str) -> Quantity:
    """The quantity of that name.

    Raises:
        ModelError: nothing of that name is watched.
    """
    if name not in QUANTITIES:
        raise ModelError(f"nothing called {name!r} is watched; there are {', '.join(QUANTITIES)}")
    return QUANTITIES[name]
