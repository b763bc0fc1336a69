"""Motion, torsion and vertical load of the isolation layer from the sensors of a record."""

from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Vector
from core.description import BuildingDescription
from core.isolation_layer.fusion import differentiate, fuse, integrate
from core.isolation_layer.motion import Integral, MeasuredMotion
from core.isolation_layer.restoration import LOWEST, high_pass_of, restored
from core.record import Direction, Finding, Record
from core.sensors.layer_agreement import LayerAgreement, agreeing, transducer_reading
from core.sensors.rigid import RigidLevels
from core.signals.conditioning import band_passed, quiet_samples
from core.signals.noise import noise_std, record_flicker

Findings = tuple[Finding, ...]

GRAVITY = 9.80665
"""m/s², standard."""
HIDING = 1.5
"""Ratio of the beginning's standard deviation to the transducer's noise below which the layer may be at rest there. A
choice: of 200 samples of noise alone, the ratio is within 5 % of 1."""
ROUNDING = 1e-6
"""Ratio of a displacement's mean to its standard deviation below which the mean of the record was its baseline. A
choice."""

NO_CHANNEL = "no displacement was measured"
"""Reason for the lack of a measured displacement, in words."""
INTEGRAL_CHANNEL = "the displacement channel contains accelerations integrated twice, so no displacement was measured"
"""Reasons for integrating the accelerations."""
NO_MOTION = "no motion of the layer"
"""Consequence where there is nothing to integrate."""


def layer_motion(
    record: Record,
    description: BuildingDescription,
    direction: Direction,
    integral: Integral = "recorded",
    agreement: LayerAgreement | None = None,
) -> tuple[MeasuredMotion | None, Findings]:
    """Motion of the layer from a transducer, from accelerometers or from both; None without either. With its findings.

    A transducer keeps the layer's residual offset. An integral is valid only within its band.

    Args:
        record: complete channels relative to their position at rest, one per level, quantity and direction.
        description: of the building.
        direction: horizontal.
        integral: what a displacement channel that was integrated from accelerations gives.
        agreement: of the layer's sensors, if it is known; None to compute it.
    """
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = record.find(base, "acceleration", direction), record.find(ground, "acceleration", direction)
    name, corner = f"direction {direction}", _flicker(record, description, direction)
    if displacement is not None and above is not None and below is not None:
        above, below = agreeing(displacement, above, below, record.rate, agreement)
    relative = None if above is None or below is None else above - below
    motion, findings = motion_from(displacement, relative, record.rate, name, corner)
    if motion is None or relative is None or displacement is None:
        return motion, findings
    if transducer_reading(record, description, direction) is not None:
        return motion, findings
    if integral == "recorded":
        as_it_is, why = _as_an_integral(motion, relative, record.rate, name)
        return as_it_is, (*why, *_offer(displacement, relative, record.rate, name))
    return _restored(motion, displacement, relative, record.rate, name)


def layer_torsion(levels: RigidLevels, description: BuildingDescription) -> tuple[MeasuredMotion | None, Findings]:
    """Torsion of the base slab relative to the ground, rad; None where the sensors' positions do not determine it.

    A ground whose torsion is not measured is assumed fixed.
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
    """Motion from a transducer's history, from the relative acceleration of the layer's two sides, or from both.

    Args:
        displacement: (n,) m, or rad.
        relative_acceleration: (n,) m/s², or rad/s².
        rate: Hz.
        name: of the moving part, for messages.
        corner: Hz, at which the accelerometers' flicker noise equals their white noise.
    """
    if displacement is not None:
        return _measured(displacement, relative_acceleration, rate, name, corner)
    if relative_acceleration is not None:
        return _integrated(relative_acceleration, rate, name, NO_CHANNEL, corner)
    return None, (
        _warning(f"{name}: neither displacement nor ground acceleration is available; no motion of the layer"),
    )


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
        return None, (_warning(f"{name}: the displacement is nowhere clearly above its noise; no motion of the layer"),)
    return _about_rest(motion, displacement, own, rate), ()


def _about_rest(motion: MeasuredMotion, displacement: Vector, noise: float, rate: float) -> MeasuredMotion:
    """The motion, with the uncertainty of the position at rest, which is a mean of few samples.

    If noise hides that the beginning is at rest, the baseline is the mean of the whole record
    (core.signals.conditioning). The mean of the beginning then shows its error. Models are fitted by the noise alone.

    Args:
        motion: of the layer.
        displacement: (n,) m, from the transducer.
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
    """The motion from a channel that is an integral, with the uncertainty of an integral of the same accelerations."""
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


def _offer(displacement: Vector, relative: Vector, rate: float, name: str) -> Findings:
    """A note that the slow motion can be restored, where the channel's high-pass is recognised."""
    found = high_pass_of(displacement, relative, rate)
    if found is None:
        return ()
    message = (
        f"{name}: the displacement channel follows the accelerations through a high-pass of {found.corner:.2g} Hz; the "
        "slow motion that it removed can be restored by the setting `analysis.integral`"
    )
    return (Finding("displacement", "note", message, None, found.corner),)


def _restored(
    motion: MeasuredMotion, displacement: Vector, relative: Vector, rate: float, name: str
) -> tuple[MeasuredMotion | None, Findings]:
    """The motion from a channel that is an integral, with the slow motion that its high-pass removed."""
    better, why = restored(displacement, relative, rate), INTEGRAL_CHANNEL
    if better is None:
        plain, findings = _as_an_integral(motion, relative, rate, name)
        message = f"{name}: {why}; its high-pass is not recognised, so that its slow motion could not be restored"
        return plain, (*findings, _warning(message))
    corner = better.high_pass.corner
    message = (
        f"{name}: {why}; the slow motion that its high-pass of {corner:.2g} Hz removed was restored "
        f"down to {LOWEST:g} Hz, without the layer's residual offset"
    )
    slow = 2 * np.pi * corner
    return replace(
        motion,
        displacement=better.displacement,
        velocity=better.velocity,
        displacement_std=np.hypot(better.std, motion.noise),
        velocity_std=np.hypot(slow * better.std, motion.velocity_std),
        band=(LOWEST, rate / 2),
        residual=None,
        is_restored=True,
    ), (Finding("displacement", "note", message, None, corner),)


def _integrated(
    relative: Vector, rate: float, name: str, why: str, corner: float = 0.0
) -> tuple[MeasuredMotion | None, Findings]:
    noise = float(noise_std(relative[None, :], rate)[0])
    motion = integrate(relative, rate, acceleration_noise=noise, corner=corner)
    if motion is None:
        message = f"{name}: {why}, and the accelerations are nowhere clearly above their noise"
        return None, (_warning(f"{message}; {NO_MOTION}"),)
    message = (
        f"{name}: {why}; it was integrated from the accelerations and is valid above {motion.band[0]:.2g} Hz, without "
        "the layer's residual offset"
    )
    return motion, (Finding("displacement", "note", message, None, motion.band[0]),)


def _flicker(record: Record, description: BuildingDescription, direction: Direction) -> float:
    """Corner frequency of the accelerometers' flicker noise, Hz, from base slab and floors; 0 without floors."""
    levels = (description.base, *description.floors)
    measured = [record.find(level.name, "acceleration", direction) for level in levels]
    series = [samples for samples in measured if samples is not None]
    return record_flicker(np.array(series), record.rate) if measured[0] is not None and len(series) > 1 else 0.0


def _warning(message: str) -> Finding:
    return Finding("displacement", "warning", message)


@dataclass(frozen=True, slots=True, eq=False)
class AxialLoad:
    """Vertical force on all isolators together."""

    ratio: Vector
    """(n,) N/W, vertical force over weight: 1 at rest, below 0 in uplift."""
    level: str
    """Name of the level whose vertical acceleration it comes from."""


def axial_load(
    record: Record, description: BuildingDescription, band: tuple[float, float]
) -> tuple[AxialLoad | None, Findings]:
    """Vertical load N/W = 1 + a_z/g of the building as one mass.

    a_z is the vertical acceleration of the base slab, otherwise of the lowest measured floor, otherwise of the ground.

    Args:
        record: complete channels relative to their position at rest, one per level, quantity and direction; z upwards.
        description: of the building.
        band: Hz, pass band.

    Returns:
        None without a vertical acceleration; a note if it is not that of the base slab.
    """
    for level in (description.base, *description.floors, description.ground):
        vertical = record.find(level.name, "acceleration", "z")
        if vertical is None:
            continue
        load = AxialLoad(np.asarray(1 + band_passed(vertical, record.rate, band) / GRAVITY), level.name)
        if level is description.base:
            return load, ()
        message = f"the vertical load comes from level {level.name!r}: the base slab has no vertical accelerometer"
        return load, (Finding("axial_load", "note", message),)
    return None, ()
