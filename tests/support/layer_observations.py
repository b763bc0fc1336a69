"""Observations of the paper's isolation layer, or of another, without an estimator."""

from datetime import UTC, datetime, timedelta

import numpy as np
from ground_motions import RATE, akt013

from core.arrays import Vector
from core.fitting.observation import LayerHistory, Observation
from core.model.isolator import Conditions, Isolator
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from core.signals.conditioning import band_passed

BAND = (0.1, 30.0)
START = datetime(2024, 3, 5, 6, 7, 8, tzinfo=UTC)
LEVELS = ("1F", "2F", "3F", "4F", "5F", "6F", "7F", "RF")
FORCE_NOISE, DISPLACEMENT_NOISE, ACCELERATION_NOISE = 0.01, 1e-5, 0.005
"""Noise: over the force's root mean square; m; m/s²."""
LATER = timedelta(days=1)


def layer_observation(
    seed: int,
    isolator: Isolator = ISOLATOR,
    scale: float = 1.0,
    motion: Vector | None = None,
    start: datetime = START,
) -> Observation:
    """One earthquake, by default AKT013 times `scale`, with white noise in all that was measured."""
    rng = np.random.default_rng(seed)
    ground = (akt013() if motion is None else motion) * scale
    moved = simulate(BUILDING, isolator, ground, RATE)
    floors = np.vstack([moved.base_acceleration, moved.floor_acceleration])
    noise = FORCE_NOISE * float(np.sqrt(np.mean(moved.force**2)))
    count = ground.size

    def noisy(exact: Vector, std: float) -> Vector:
        return np.asarray(exact + std * rng.standard_normal(exact.shape))

    return Observation(
        name=f"{start:%Y-%m-%d %H:%M:%S}",
        direction="x",
        start=start,
        rate=RATE,
        layer=LayerHistory(
            displacement=moved.isolator_displacement,
            velocity=moved.isolator_velocity,
            force=band_passed(noisy(moved.force, noise), RATE, BAND),
            force_std=np.full(count, noise * np.sqrt((BAND[1] - BAND[0]) / (RATE / 2))),
            displacement_std=np.full(count, DISPLACEMENT_NOISE),
            band=BAND,
        ),
        conditions=Conditions.usual(count, RATE),
        ground_acceleration=ground,
        accelerations=noisy(floors, ACCELERATION_NOISE),
        levels=LEVELS,
        transducer=True,
    )
