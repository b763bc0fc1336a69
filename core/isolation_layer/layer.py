"""What do the sensors of a record say about the isolation layer's motion?"""

from dataclasses import replace

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription
from core.isolation_layer.displacement import differentiate, fuse
from core.isolation_layer.integration import integrate
from core.isolation_layer.motion import MeasuredMotion
from core.quality import Finding
from core.record import Direction, Record
from core.sensors.integrated_channel import transducer_reading
from core.sensors.layer_agreement import agreeing
from core.sensors.rigid import RigidLevels
from core.signals.conditioning import quiet_samples
from core.signals.flicker import record_flicker
from core.signals.noise import noise_std

Findings = tuple[Finding, ...]

HIDING = 1.5
"""Of the transducer's noise: a beginning that scatters no more may be at rest."""
ROUNDING = 1e-6
"""Of the standard deviation of a displacement: its mean is no farther from zero where the mean was taken for rest."""

NO_CHANNEL = "no displacement was measured"
INTEGRAL_CHANNEL = "the displacement channel holds accelerations integrated twice, so no displacement was measured"


def layer_motion(
    record: Record, description: BuildingDescription, direction: Direction
) -> tuple[MeasuredMotion | None, Findings]:
    """Motion of the layer from whatever measured it, None if nothing did; and what its user should know.

    Where a transducer measured it the layer's residual offset stays; an integral is good only above a frequency that
    its band tells.

    Args:
        record: complete channels about their position at rest, one for each level, quantity and direction.
        description: of the building.
        direction: horizontal.
    """
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = record.find(base, "acceleration", direction), record.find(ground, "acceleration", direction)
    name, corner = f"direction {direction}", _flicker(record, description, direction)
    if displacement is not None and above is not None and below is not None:
        above, below = agreeing(displacement, above, below, record.rate)
    relative = None if above is None or below is None else above - below
    motion, findings = motion_from(displacement, relative, record.rate, name, corner)
    if motion is None or relative is None or displacement is None:
        return motion, findings
    if transducer_reading(record, description, direction) is not None:
        return motion, findings
    return _as_an_integral(motion, relative, record.rate, name)


def layer_torsion(levels: RigidLevels, description: BuildingDescription) -> tuple[MeasuredMotion | None, Findings]:
    """Torsion of the base slab against the ground in rad, None where the sensors' positions do not tell it.

    A ground whose torsion is not measured is taken not to turn.
    """
    base, ground = description.base.name, description.ground.name
    displacement = levels.torsion.get((base, "displacement"))
    above, below = levels.torsion.get((base, "acceleration")), levels.torsion.get((ground, "acceleration"))
    if displacement is None and above is None:
        return None, ()
    relative = above if above is None or below is None else above - below
    return motion_from(displacement, relative, levels.record.rate, "torsion")


def motion_from(
    displacement: Vector | None, relative_acceleration: Vector | None, rate: float, name: str, corner: float = 0.0
) -> tuple[MeasuredMotion | None, Findings]:
    """Motion from a transducer's history, from the acceleration above the layer less that below, or from both.

    Args:
        displacement: (n,) m, or rad.
        relative_acceleration: (n,) m/s², or rad/s².
        rate: Hz.
        name: of what moves, for messages.
        corner: Hz, at which the accelerometers' flicker noise is as strong as their white noise.
    """
    if displacement is not None:
        return _measured(displacement, relative_acceleration, rate, name, corner)
    if relative_acceleration is not None:
        return _integrated(relative_acceleration, rate, name, NO_CHANNEL, corner)
    return None, (_warning(f"{name}: neither displacement nor ground acceleration; no motion of the layer"),)


def _measured(
    displacement: Vector, relative: Vector | None, rate: float, name: str, corner: float
) -> tuple[MeasuredMotion | None, Findings]:
    if relative is not None:
        noise = noise_std(np.array([displacement, relative]), rate)
        own, other = float(noise[0]), float(noise[1])
        fused = fuse(displacement, relative, rate, displacement_noise=own, acceleration_noise=other, corner=corner)
        return _about_rest(fused, displacement, own, rate), ()
    own = float(noise_std(displacement[None, :], rate)[0])
    motion = differentiate(displacement, rate, displacement_noise=own)
    if motion is None:
        return None, (_warning(f"{name}: the displacement nowhere stands above its noise; no motion of the layer"),)
    return _about_rest(motion, displacement, own, rate), ()


def _about_rest(motion: MeasuredMotion, displacement: Vector, noise: float, rate: float) -> MeasuredMotion:
    """With the uncertainty of the position at rest, which is a mean of few samples.

    A beginning that noise hides to be at rest leaves zero at the mean of the whole record (core.signals.conditioning).
    The beginning's own mean then says how far off that is. Models are fitted by the noise alone.

    Args:
        motion: of the layer.
        displacement: (n,) m, by the transducer.
        noise: m, its standard deviation.
        rate: Hz.
    """
    quiet = displacement[: quiet_samples(displacement.size, rate)]
    few = noise / np.sqrt(quiet.size)
    about_its_mean = abs(displacement.mean()) < ROUNDING * displacement.std()
    is_hidden = about_its_mean and quiet.std() < HIDING * noise
    offset = max(0.0, float(quiet.mean()) ** 2 - few**2) if is_hidden else 0.0
    std = np.hypot(motion.displacement_std, few)
    return replace(motion, displacement_std=np.hypot(std, np.sqrt(offset)), noise_std=(std, motion.velocity_std))


def _as_an_integral(
    motion: MeasuredMotion, relative: Vector, rate: float, name: str
) -> tuple[MeasuredMotion | None, Findings]:
    """A motion from a channel that is an integral, known no better than an integral of the same accelerations."""
    integral, findings = _integrated(relative, rate, name, INTEGRAL_CHANNEL)
    if integral is None:
        return None, findings
    return replace(
        motion,
        displacement_std=integral.displacement_std,
        velocity_std=integral.velocity_std,
        band=integral.band,
        residual=None,
    ), findings


def _integrated(
    relative: Vector, rate: float, name: str, why: str, corner: float = 0.0
) -> tuple[MeasuredMotion | None, Findings]:
    noise = float(noise_std(relative[None, :], rate)[0])
    motion = integrate(relative, rate, acceleration_noise=noise, noise_corner=corner)
    if motion is None:
        message = f"{name}: {why}, and the accelerations nowhere stand above their noise"
        return None, (_warning(f"{message}; no motion of the layer"),)
    message = (
        f"{name}: {why}; it was integrated from the accelerations and is good above "
        f"{motion.band[0]:.2g} Hz, without the layer's residual offset"
    )
    return motion, (Finding("displacement", "note", message, None, motion.band[0]),)


def _flicker(record: Record, description: BuildingDescription, direction: Direction) -> float:
    """Hz, corner of the accelerometers' flicker noise, by what base slab and floors do not move in common."""
    levels = (description.base, *description.floors)
    told = [record.find(level.name, "acceleration", direction) for level in levels]
    series = [samples for samples in told if samples is not None]
    return record_flicker(np.array(series), record.rate) if told[0] is not None and len(series) > 1 else 0.0


def _warning(message: str) -> Finding:
    return Finding("displacement", "warning", message)
