"""The building as the engineer knows it: levels, design values and channels, with their errors."""

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription, IsolationDesign, IsolationLayer, Level
from core.record import Channel, Direction
from hidden.building import Building
from hidden.case import Case
from hidden.law import Need

FLOORS = ("2F", "3F", "4F", "5F", "6F", "7F", "RF")
LEVELS = ("1F", *FLOORS)
INSTRUMENTED = ("1F", "4F", "RF")
"""Levels with an accelerometer besides the ground, as the paper has them."""
CODES = {"ground": "00"} | {name: f"{number:02d}" for number, name in enumerate(LEVELS, start=1)}


def describe(building: Building, case: Case, happens: frozenset[Need], rng: np.random.Generator) -> BuildingDescription:
    """The building as described: about right, and off where the case says so."""
    structure, layer = building.superstructure, building.layer
    floor_mass = structure.floor_mass * (1 + case.masses_error * rng.standard_normal(7))
    base_mass = structure.total_mass - float(floor_mass.sum())
    off = 1 + case.total_off * float(rng.choice([-1, 1]))
    stiffness = structure.storey_stiffness * (1 + 0.04 * rng.standard_normal())
    levels = [Level("ground", "ground"), Level("1F", "base", base_mass * off)]
    levels += [
        Level(name, "floor", float(m) * off, float(k)) for name, m, k in zip(FLOORS, floor_mass, stiffness, strict=True)
    ]
    design = _design(np.array([layer.k, layer.c, layer.F_y, layer.D_y]), case, rng)
    channels = tuple(_channels(happens))
    return BuildingDescription("TRIAL", "a building under trial", tuple(levels), IsolationLayer(0.2, design), channels)


def _design(true: Vector, case: Case, rng: np.random.Generator) -> IsolationDesign:
    off = case.design_error * rng.standard_normal(4) + case.design_off * rng.choice([-1, 1], 4)
    k_b, c_b, F_y, D_y = (float(value) for value in true * (1 + off))
    return IsolationDesign(k_b, c_b, F_y, D_y)


def _channels(happens: frozenset[Need]) -> list[Channel]:
    horizontal: tuple[Direction, ...] = ("x", "y") if "cross" in happens else ("x",)
    names = {"x": "X", "y": "Y"}
    channels = [
        Channel(f"XX.TRIAL.{CODES[level]}.HN{names[direction]}", level, "acceleration", direction)
        for level in ("ground", *INSTRUMENTED)
        for direction in horizontal
    ]
    channels += [Channel(f"XX.TRIAL.01.HY{names[d]}", "1F", "displacement", d) for d in horizontal]
    if "vertical" in happens:
        channels.append(Channel("XX.TRIAL.01.HNZ", "1F", "acceleration", "z"))
    if "temperature" in happens:
        channels.append(Channel("XX.TRIAL.01.KO", "1F", "temperature"))
    return channels
