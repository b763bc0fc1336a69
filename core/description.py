"""Description of a building: levels, isolation layer and sensors."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Literal

from core.errors import ModelError
from core.record import Channel, Direction

if TYPE_CHECKING:
    from core.arrays import Vector

Role = Literal["ground", "base", "floor"]


@dataclass(frozen=True, slots=True)
class Level:
    """One level of the building."""

    name: str
    role: Role
    """`ground` below the isolators, `base` the slab just above them, `floor` any level of the superstructure."""
    mass: float | None = None
    """kg; None for the ground only."""
    stiffness: float | None = None
    """N/m, design value of the storey below this floor; None if not given."""
    mass_uncertainty: float = 0.0
    """Standard deviation of the mass over the mass, the total of all masses being right."""
    height: float | None = None
    """m, of the storey below this floor; None if not given."""


@dataclass(frozen=True, slots=True)
class IsolationDesign:
    """The isolation layer's design values; None if not given."""

    k_b: float | None = None
    """N/m, post-yield stiffness."""
    c_b: float | None = None
    """N s/m, viscous damping coefficient."""
    F_y: float | None = None
    """N, yield force of the hysteretic part."""
    D_y: float | None = None
    """m, yield displacement of the hysteretic part."""


@dataclass(frozen=True, slots=True)
class IsolationLayer:
    """The isolation layer as designed."""

    rubber_height: float | None = None
    """m, displacement of 100 % shear strain."""
    design: IsolationDesign = IsolationDesign()
    design_displacement: float | None = None
    """m, design displacement; None if not given."""
    moat_clearance: float | None = None
    """m, smallest gap between the building and the surrounding wall; None if not given."""
    damper_stroke: float | None = None
    """m, rated stroke of the dampers; None without dampers."""
    rubber: Literal["natural", "high_damping", "lead"] | None = None
    """Compound of the bearings; None if not given."""
    installed: date | None = None
    """Day when the bearings were installed; None if not given."""


@dataclass(frozen=True, slots=True)
class BuildingDescription:
    """Levels from the ground up, the isolation layer between the first two, and the sensors."""

    code: str
    name: str
    levels: tuple[Level, ...]
    isolation: IsolationLayer
    channels: tuple[Channel, ...]

    def __post_init__(self) -> None:
        roles = [level.role for level in self.levels]
        if roles[:2] != ["ground", "base"] or set(roles[2:]) != {"floor"}:
            raise ModelError(f"levels go ground, base, floors from the ground up, got {roles}")
        for level in self.levels[1:]:
            if level.mass is None or not level.mass > 0:
                raise ModelError(f"level {level.name!r} needs a mass above 0 kg, got {level.mass}")
            if not 0 <= level.mass_uncertainty < 1:
                raise ModelError(
                    f"level {level.name!r} needs a mass_uncertainty from 0 to below 1, got {level.mass_uncertainty}"
                )

    @property
    def ground(self) -> Level:
        """The level below the isolators."""
        return self.levels[0]

    @property
    def base(self) -> Level:
        """The slab just above the isolators."""
        return self.levels[1]

    @property
    def floors(self) -> tuple[Level, ...]:
        """The superstructure's levels, from the lowest to the roof."""
        return self.levels[2:]

    @property
    def base_mass(self) -> float:
        """Mass of the base slab in kg."""
        return float(self.base.mass or 0.0)

    @property
    def floor_mass(self) -> "Vector":
        """(floors,) kg, from the lowest floor to the roof."""
        return _vector([level.mass for level in self.floors])

    @property
    def mass_uncertainty(self) -> "Vector":
        """(1 + floors,) standard deviations of the masses over the masses, the base slab's first."""
        return _vector([level.mass_uncertainty for level in self.levels[1:]])

    @property
    def storey_stiffness(self) -> "Vector | None":
        """(floors,) N/m, design stiffness of the storey below each floor; None unless all are given."""
        stiffness = [level.stiffness for level in self.floors]
        return None if None in stiffness else _vector(stiffness)

    @property
    def horizontal_directions(self) -> tuple[Direction, ...]:
        """The horizontal directions in which the base slab's acceleration is measured."""
        measured = {c.direction for c in self.channels if c.level == self.base.name and c.quantity == "acceleration"}
        return tuple(direction for direction in ("x", "y") if direction in measured)


def _vector(values: Sequence[float | None]) -> "Vector":
    import numpy as np  # takes long to import, and most commands describe a building without computing

    return np.array(values, dtype=float)
