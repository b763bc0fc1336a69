"""Measurements of a layer with coupled directions in one earthquake."""

from dataclasses import replace
from datetime import datetime

import numpy as np
from ground_motions import RATE, akt013, kobe
from layer_observations import ACCELERATION_NOISE, BAND, DISPLACEMENT_NOISE, FORCE_NOISE, LEVELS, START

from core.building import fixed_base_modes
from core.fitting.observation import LayerHistory, Observation
from core.model.isolator import Conditions, Isolator
from core.model.simulation import Axis, Response, respond
from core.paper import BUILDING, ISOLATOR
from core.record import Direction

COUPLED = Isolator(
    {
        **ISOLATOR.effects,
        "bouc_wen": {"F_y": 4e6, "D_y": 6e-3, "A": 1.0, "beta": 0.5, "gamma": 0.5, "n": 1.0},
        "biaxial": {"joined": 1.0, "D_cross": 6e-3},
    }
)
"""A third of the largest force is its yield force."""


def biaxial_observation(
    seed: int, isolator: Isolator = COUPLED, scale: float = 1.0, start: datetime = START, count: int = 6000
) -> tuple[Observation, Observation]:
    """Along x AKT013, along y Kobe, both times `scale`; all with white noise, the force not filtered."""
    rng, modes = np.random.default_rng(seed), fixed_base_modes(BUILDING)
    usual = Conditions.usual(count, RATE)
    axes = [Axis(modes, scale * motion()[:count], usual) for motion in (akt013, kobe)]
    x, y = respond(axes, BUILDING.base_mass, isolator, RATE)
    return (
        _observation("x", axes[0], x, y, start, rng),
        _observation("y", axes[1], y, x, start, rng),
    )


def _observation(
    direction: Direction, axis: Axis, moved: Response, cross: Response, start: datetime, rng: np.random.Generator
) -> Observation:
    noise, count = FORCE_NOISE * float(np.std(moved.force)), moved.force.size
    floors = np.vstack([moved.base_acceleration, moved.floor_acceleration])
    return Observation(
        name=f"{start:%Y-%m-%d %H:%M:%S}",
        direction=direction,
        start=start,
        rate=RATE,
        layer=LayerHistory(
            displacement=moved.isolator_displacement,
            velocity=moved.isolator_velocity,
            force=moved.force + noise * rng.standard_normal(count),
            force_std=np.full(count, noise * np.sqrt((BAND[1] - BAND[0]) / (RATE / 2))),
            displacement_std=np.full(count, DISPLACEMENT_NOISE),
        ),
        conditions=replace(axis.conditions, u_cross=cross.isolator_displacement, v_cross=cross.isolator_velocity),
        ground_acceleration=axis.ground_acceleration,
        accelerations=floors + ACCELERATION_NOISE * rng.standard_normal(floors.shape),
        levels=LEVELS,
        transducer=True,
    )
