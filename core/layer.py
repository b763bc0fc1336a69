"""What do the sensors of a record say about the isolation layer's motion?"""

from dataclasses import replace

import numpy as np

from core.arrays import Vector
from core.conditioning import band_passed
from core.description import BuildingDescription
from core.displacement import Motion, fuse, integrate
from core.noise import noise_std
from core.quality import Finding
from core.record import Direction, Record


def layer_motion(
    record: Record, description: BuildingDescription, direction: Direction, band: tuple[float, float]
) -> tuple[Motion | None, tuple[Finding, ...]]:
    """Motion of the layer from whatever measured it, None if nothing did; and what its user should know.

    The displacement is not high-passed where a transducer measured it, so that the layer's residual offset stays.

    Args:
        record: complete channels about their position at rest.
        description: of the building.
        direction: horizontal.
        band: Hz; below it accelerations are not integrated, outside it a displacement alone is not differentiated.
    """
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = record.find(base, "acceleration", direction), record.find(ground, "acceleration", direction)
    if above is not None and below is not None:
        relative = above - below
        if displacement is not None:
            return _fused(displacement, relative, record.rate), ()
        noise = float(noise_std(relative[None, :], record.rate)[0])
        motion = integrate(relative, record.rate, band[0], acceleration_noise=noise)
        return motion, (_integrated(direction, band[0]),)
    if displacement is not None:
        return _differentiated(displacement, record.rate, band), ()
    message = f"direction {direction}: neither displacement nor ground acceleration; no motion of the layer"
    return None, (Finding("displacement", "warning", message),)


def _fused(displacement: Vector, relative: Vector, rate: float) -> Motion:
    noise = noise_std(np.array([displacement, relative]), rate)
    return fuse(displacement, relative, rate, displacement_noise=float(noise[0]), acceleration_noise=float(noise[1]))


def _differentiated(displacement: Vector, rate: float, band: tuple[float, float]) -> Motion:
    """Motion from the transducer alone: a vanishing noise gives the accelerations no weight."""
    smooth = band_passed(displacement, rate, band)
    motion = fuse(smooth, np.zeros_like(smooth), rate, displacement_noise=0.0, acceleration_noise=1.0)
    return replace(motion, noise=float(noise_std(displacement[None, :], rate)[0]))


def _integrated(direction: Direction, lowest: float) -> Finding:
    message = (
        f"direction {direction}: no displacement was measured; it was integrated from the accelerations above "
        f"{lowest:g} Hz, without the layer's residual offset"
    )
    return Finding("displacement", "note", message)
