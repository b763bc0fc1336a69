"""Do the channels' clocks agree?

Below the first fixed-base frequency every level above the isolators moves as the base slab does but for its
quasi-static deflection, so that its delay shows. The layer's displacement x is bound to both its sides by
x'' = a_base − a_ground. Without a displacement nothing binds the ground to the rest (the layer between them may do
what it likes), and its clock cannot be judged.

All delays are found against the base slab, and told against the majority of the channels: if the base slab alone is
late, it is the one that is named.
"""

from collections.abc import Sequence

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.description import BuildingDescription
from core.quality import Finding
from core.record import Channel, Direction, Quantity, Record

BAND = (0.2, 0.7)
"""Hz, above the accelerometers' drift and below the first fixed-base frequency."""
UNEXPLAINED = 0.03
"""Of a window's power, what may be left when its delays are taken out."""
LATE = 0.03
"""s; the damping of a real building makes 0.007 s of it."""
JUMP = 0.06
"""s, between two windows of 20 s."""
WINDOW = 20.0
"""s."""
STRONG = 1e-3
"""Of the strongest window's power: below, what earlier processing left of the motion is no motion."""
CERTAIN = 0.01
"""s, standard deviation up to which a delay counts."""
ROUNDS = 3
"""Of Gauss and Newton's iteration: the phase of 0.15 s at 0.7 Hz is no longer small."""
MAJORITY = 3
"""Clocks that it takes to outvote one."""


def clock_faults(
    record: Record, description: BuildingDescription, direction: Direction, usable: Sequence[Channel]
) -> tuple[Finding, ...]:
    """Warnings for channels whose clock differs from that of the others, all the time or from some time on.

    Args:
        record: complete channels about their position at rest.
        description: of the building.
        direction: horizontal.
        usable: those of the record's channels that are clear above their noise.
    """
    channels, delays = _delays(record, description, direction, usable)
    if len(channels) < 2:
        return ()
    if len(channels) >= MAJORITY:
        delays = _against_the_majority(delays)
    findings = (_fault(channel, own[np.isfinite(own)]) for channel, own in zip(channels, delays.T, strict=True))
    return tuple(finding for finding in findings if finding is not None)


def _against_the_majority(delays: Matrix) -> Matrix:
    """(windows, channels) s, less the median of the window; NaN where fewer than three clocks are known."""
    told = np.full_like(delays, np.nan)
    for window, own in zip(told, delays, strict=True):
        if np.isfinite(own).sum() >= MAJORITY:
            window[:] = own - np.nanmedian(own)
    return told


def _fault(channel: Channel, delays: Vector) -> Finding | None:
    if delays.size == 0:
        return None
    jump, delay = float(np.ptp(delays)), float(np.median(delays))
    if jump > JUMP:
        message = f"its clock jumps by {jump:.3g} s against the others within the event; check the logger's clock"
        return Finding("clock", "warning", message, channel.id, jump)
    if abs(delay) > LATE:
        message = f"is {delay:.3g} s late against the others; check the logger's clock"
        return Finding("delay", "warning", message, channel.id, delay)
    return None


def _delays(
    record: Record, description: BuildingDescription, direction: Direction, usable: Sequence[Channel]
) -> tuple[list[Channel], Matrix]:
    """Channels and (windows, channels) s, delay of each against the base slab; NaN where it is not certain."""
    rows: dict[tuple[str, Quantity], tuple[Channel, Vector]] = {
        (channel.level, channel.quantity): (channel, samples)
        for channel, samples in zip(record.channels, record.samples, strict=True)
        if channel in usable and channel.direction == direction
    }
    base = rows.get((description.base.name, "acceleration"))
    if base is None:
        return [], np.empty((0, 0))
    floors = [rows[level.name, "acceleration"] for level in description.floors if (level.name, "acceleration") in rows]
    layer = rows.get((description.base.name, "displacement"))
    ground = rows.get((description.ground.name, "acceleration"))
    sides = [ground, layer] if ground is not None and layer is not None else []
    taken = [base, *floors, *sides]
    ω, windows = _windowed(taken, record.rate)
    delays = np.full((len(windows), len(taken)), np.nan)
    power = np.array([np.vdot(spectra[0], spectra[0]).real for _, spectra in windows])
    strong = power > STRONG * power.max(initial=0.0)
    for i in np.flatnonzero(strong):
        found, (slopes, spectra) = delays[i], windows[i]
        base_motion = np.vstack([spectra[0], slopes[0]])
        found[0] = 0.0
        for place in range(1, len(floors) + 1):
            found[place] = _beside(ω, spectra[place], slopes[place + 1], base_motion)
        if sides:
            found[-2:] = _across(ω, spectra[0], spectra[-2], spectra[-1])
    return [channel for channel, _ in taken], delays


def _windowed(
    taken: Sequence[tuple[Channel, Vector]], rate: float
) -> tuple[Vector, list[tuple[ComplexMatrix, ComplexMatrix]]]:
    """(frequencies,) rad/s, and for each window spectra: of a_base'' and every slope; of every acceleration."""
    accelerations = np.array([_acceleration(channel, samples, rate) for channel, samples in taken])
    slopes = np.gradient(accelerations, axis=1) * rate
    rows = np.vstack([np.gradient(slopes[0]) * rate, slopes, accelerations])
    length = round(WINDOW * rate)
    frequency = np.fft.rfftfreq(length, 1 / rate)
    within = (frequency >= BAND[0]) & (frequency <= BAND[1])
    windows = []
    for start in range(0, rows.shape[1] - length + 1, length // 2):
        piece = rows[:, start : start + length]
        tapered = (piece - piece.mean(axis=1, keepdims=True)) * np.hanning(length)
        spectra = np.fft.rfft(tapered, axis=1)[:, within]
        windows.append((spectra[: -len(taken)], spectra[-len(taken) :]))
    return np.asarray(2 * np.pi * frequency[within]), windows


def _acceleration(channel: Channel, samples: Vector, rate: float) -> Vector:
    if channel.quantity == "acceleration":
        return samples
    return np.asarray(np.gradient(np.gradient(samples)) * rate**2)


def _beside(ω: Vector, own: ComplexVector, slope: ComplexVector, base: ComplexMatrix) -> float:
    """s, delay τ of a level above the isolators against the base slab; NaN where it is not certain.

    Least squares of a = p a_base + γ a_base'' − τ a': p and γ are the quasi-static deflection. The derivatives were
    taken before the window, which would turn growing motion into delay.
    """
    delay = 0.0
    for _ in range(ROUNDS + 1):
        moved, across = np.array([own, slope]) * np.exp(1j * ω * delay)
        columns = np.vstack([base, across])
        gram = (columns @ columns.conj().T).real
        solution = np.linalg.lstsq(gram, (columns.conj() @ moved).real, rcond=None)[0]
        delay -= solution[2]
    residual = moved - solution @ columns
    left, power = np.vdot(residual, residual).real, np.vdot(own, own).real
    variance = left / (2 * ω.size - 3) * np.linalg.pinv(gram)[2, 2]
    return float(delay) if left < UNEXPLAINED * power and variance < CERTAIN**2 else float("nan")


def _across(ω: Vector, base: ComplexVector, ground: ComplexVector, layer: ComplexVector) -> tuple[float, float]:
    """s, delays of the ground and of the layer's displacement against the base slab; NaN where they are not certain.

    Least squares of a_base = a_ground exp(iω τ_ground) + x'' exp(iω τ_x).
    """
    delays = np.zeros(2)
    for _ in range(ROUNDS + 1):
        late = np.array([ground, layer]) * np.exp(1j * np.outer(delays, ω))
        residual = base - late.sum(axis=0)
        slope = 1j * ω * late
        gram = (slope @ slope.conj().T).real
        step = np.linalg.lstsq(gram, (slope.conj() @ residual).real, rcond=None)[0]
        delays += step
    left = np.vdot(residual, residual).real
    variance = left / (2 * ω.size - 2) * np.diag(np.linalg.pinv(gram))
    certain = left < UNEXPLAINED * np.vdot(layer, layer).real and (variance < CERTAIN**2).all()
    return (float(delays[0]), float(delays[1])) if certain else (float("nan"), float("nan"))
