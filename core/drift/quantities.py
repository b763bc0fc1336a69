"""Quantities monitored for drift, and their prior: how each behaves in a healthy building.

The typical scatters and temperature coefficients are the centres of priors: each series is scaled by its own data
(`core.drift.scatter`, `core.drift.baseline`). The rules were tuned on stiffness alone (docs/operate/drift.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from core.errors import ModelError

BOTH_DIRECTIONS = "xy"
"""Subject of the mean of both directions of the isolation layer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """Prior knowledge of one monitored quantity."""

    name: str
    """Identifier, as stored and as in the API."""
    title: str
    """Name for people, as in "stiffness of the isolation layer"."""
    is_logarithmic: bool
    """True if relative changes are monitored; else changes in SI units are."""
    follows_amplitude: bool
    """True if a healthy value depends on the amplitude of motion."""
    follows_temperature: bool
    """True if a healthy value depends on the temperature of the isolation layer."""
    harm: Literal["less", "more", "either"]
    """Sign of a change for the worse; a change of the other sign is a recovery."""
    scatter: float
    """Typical standard deviation between healthy events once amplitude and temperature are accounted for; relative, or
    SI units."""
    within_event_scatter: float
    """Typical standard deviation between the measurements of one event, without their own; relative, or SI units."""
    softening: float = 0.0
    """Standard deviation of the loss that recovers after an earthquake larger than all before, per unit of the natural
    logarithm of the ratio of amplitudes; relative."""
    hardens: bool = False
    """True if a healthy value grows with the age of the rubber."""
    temperature_coefficient: tuple[float, float] = (0.0, 0.0)
    """Mean and standard deviation, among buildings, of the change per kelvin; relative."""


_every = (
    Quantity(
        name="stiffness",
        title="stiffness of the isolation layer",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=True,
        harm="less",
        scatter=0.01,
        within_event_scatter=0.01,
        softening=0.015,
        hardens=True,
        temperature_coefficient=(-0.004, 0.004),
    ),
    Quantity(
        name="damping",
        title="damping of the isolation layer",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=True,
        harm="less",
        scatter=0.03,
        within_event_scatter=0.05,
        softening=0.015,
        temperature_coefficient=(-0.004, 0.006),
    ),
    Quantity(
        name="frequency",
        title="natural frequency of the superstructure",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=True,
        harm="less",
        scatter=0.01,
        within_event_scatter=0.01,
        temperature_coefficient=(0.0, 0.001),
    ),
    Quantity(
        name="gain",
        title="gain of a sensor against its neighbours",
        is_logarithmic=True,
        follows_amplitude=False,
        follows_temperature=False,
        harm="either",
        scatter=0.005,
        within_event_scatter=0.005,
    ),
    Quantity(
        name="noise",
        title="noise floor of a sensor",
        is_logarithmic=True,
        follows_amplitude=False,
        follows_temperature=False,
        harm="more",
        scatter=0.2,
        within_event_scatter=0.1,
    ),
    Quantity(
        name="residual_displacement",
        title="displacement at which the isolation layer rests",
        is_logarithmic=False,
        follows_amplitude=False,
        follows_temperature=False,
        harm="either",
        scatter=5e-4,
        within_event_scatter=1e-4,
    ),
    Quantity(
        name="model_error",
        title="error of the isolator model",
        is_logarithmic=True,
        follows_amplitude=True,
        follows_temperature=False,
        harm="more",
        scatter=0.1,
        within_event_scatter=0.1,
    ),
)

QUANTITIES: Mapping[str, Quantity] = MappingProxyType({quantity.name: quantity for quantity in _every})
"""Monitored quantities by name."""
LAYER_QUANTITIES = ("stiffness", "damping")
"""Quantities that are made from the restoring force, so that a wrong mass or gain changes them."""
SENSOR_QUANTITIES = frozenset({"gain", "noise"})
"""Quantities of a sensor, whose series are named by its channel."""


def quantity(name: str) -> Quantity:
    """The monitored quantity with this name.

    Raises:
        ModelError: no monitored quantity has this name.
    """
    if name not in QUANTITIES:
        raise ModelError(f"there is no monitored quantity {name!r}; choose one of {', '.join(QUANTITIES)}")
    return QUANTITIES[name]
