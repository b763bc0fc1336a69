"""Clocks of the channels within one event: constant delays and jumps, window by window.

Well below the first fixed-base frequency every level above the isolators moves as the base slab but for its
quasi-static deflection, so that its delay shows. The layer's displacement x relates both sides: x'' = a_base −
a_ground. Without a displacement, nothing relates the ground's clock to the others.

All delays are estimated relative to the base slab, and reported relative to the median of the channels: if the base
slab alone is late, it is the one that is named.

core.sensors.layer_agreement and core.sensors.floor_agreement estimate delays too, with covariances, together with gains
and clock rates. They need a whole record; a clock that jumps shows in single windows only, which are estimated here.
"""

from collections.abc import Sequence

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Mask, Matrix, Vector
from core.building import ShearBuilding, fixed_base_modes
from core.description import BuildingDescription
from core.record import Channel, Direction, Finding, Quantity, Record
from core.signals.spectra import hann_spectra, second_derivative

BAND = (0.2, 0.7)
"""Hz, above the accelerometers' drift and below the first fixed-base frequency of all but tall buildings."""
BELOW_FIRST = 0.7
"""Highest frequency over the first fixed-base frequency at which levels move as one body but for a quasi-static
deflection, which is then as much again as the base slab's motion. Not tuned."""
PERIOD_PER_STOREY, PERIOD_PER_METRE = 0.1, 0.02
"""s, usual first fixed-base period for each storey, and for each metre of height (Building Standard Law of Japan,
Notification 1793 of 1980: concrete)."""
FEWEST_LINES = 5
"""Lines of a spectrum with which two levels can be compared. A choice."""
UNEXPLAINED = 0.03
"""Share of a window's power that may remain with the delays removed. Not tuned."""
LATE = 0.03
"""s, delay that is reported; the damping of a real building causes 0.007 s. A choice."""
JUMP = 0.06
"""s, difference between two windows that is reported. A choice: twice LATE."""
WINDOW = 20.0
"""s, duration of a window. A choice: ten lines in the band."""
STRONG = 1e-3
"""Power over that of the strongest window, below which a window is residue of earlier processing. Not tuned."""
LARGEST_STD = 0.01
"""s, standard deviation up to which a delay counts. A choice: a third of LATE."""
ROUNDS = 3
"""Gauss-Newton iterations after the first: the phase of 0.15 s at 0.7 Hz is not small."""
MAJORITY = 3
"""Fewest clocks whose median is a reference: with two, neither outvotes the other."""


def one_body_below(description: BuildingDescription) -> float:
    """Hz, up to which all levels above the isolators move as one body but for their quasi-static deflection.

    From the first fixed-base frequency of the design, if the storeys' stiffness is given, else of usual buildings with
    as many storeys or as high, whichever is lower.
    """
    floors, stiffness = description.floors, description.storey_stiffness
    if stiffness is not None:
        building = ShearBuilding(description.base_mass, description.floor_mass, stiffness, 0.0)
        first = float(fixed_base_modes(building).angular_frequency[0]) / (2 * np.pi)
    else:
        height = sum(floor.height or 0.0 for floor in floors)
        first = 1 / max(PERIOD_PER_STOREY * len(floors), PERIOD_PER_METRE * height)
    return min(BAND[1], BELOW_FIRST * first)


def one_body(frequency: Vector, description: BuildingDescription) -> Mask:
    """(lines,) True where all levels above the isolators move as one body; nowhere if too few lines do.

    Args:
        frequency: (lines,) Hz, within BAND.
        description: of the building.
    """
    below = frequency <= one_body_below(description)
    return np.asarray(below & (np.count_nonzero(below) >= FEWEST_LINES))


def clock_faults(
    record: Record, description: BuildingDescription, direction: Direction, usable: Sequence[Channel]
) -> tuple[Finding, ...]:
    """Warnings for channels whose clock differs from the others, throughout or from some time on.

    Args:
        record: complete channels relative to their position at rest.
        description: of the building.
        direction: horizontal.
        usable: channels of the record that are clear above their noise.
    """
    channels, delays = _delays(record, description, direction, usable)
    if len(channels) < 2:
        return ()
    if len(channels) >= MAJORITY:
        delays = _relative_to_median(delays)
    findings = (_fault(channel, own[np.isfinite(own)]) for channel, own in zip(channels, delays.T, strict=True))
    return tuple(finding for finding in findings if finding is not None)


def _relative_to_median(delays: Matrix) -> Matrix:
    """(windows, channels) s, less the median of the window; NaN where fewer than MAJORITY clocks are known."""
    relative = np.full_like(delays, np.nan)
    for window, own in zip(relative, delays, strict=True):
        if np.isfinite(own).sum() >= MAJORITY:
            window[:] = own - np.nanmedian(own)
    return relative


def _fault(channel: Channel, delays: Vector) -> Finding | None:
    if delays.size == 0:
        return None
    jump, delay = float(np.ptp(delays)), float(np.median(delays))
    if jump > JUMP:
        message = f"its clock jumps by {jump:.3g} s relative to the others within the event; check the logger's clock"
        return Finding("clock", "warning", message, channel.id, jump)
    if abs(delay) > LATE:
        message = f"is {delay:.3g} s late relative to the others; check the logger's clock"
        return Finding("delay", "warning", message, channel.id, delay)
    return None


def _delays(
    record: Record, description: BuildingDescription, direction: Direction, usable: Sequence[Channel]
) -> tuple[list[Channel], Matrix]:
    """Channels and (windows, channels) s, delay of each relative to the base slab; NaN where it is uncertain."""
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
    used = [base, *floors, *sides]
    ω, windows = _windowed(used, record.rate)
    delays = np.full((len(windows), len(used)), np.nan)
    low = one_body(ω / (2 * np.pi), description)
    power = np.array([np.vdot(spectra[0], spectra[0]).real for _, spectra in windows])
    strong = power > STRONG * power.max(initial=0.0)
    for i in np.flatnonzero(strong):
        delay, (slopes, spectra) = delays[i], windows[i]
        base_motion = np.vstack([spectra[0], slopes[0]])
        delay[0] = 0.0
        for place in range(1, len(floors) + 1) if low.any() else ():
            delay[place] = _floor_delay(ω[low], spectra[place, low], slopes[place + 1, low], base_motion[:, low])
        if sides:
            delay[-2:] = _layer_delays(ω, spectra[0], spectra[-2], spectra[-1])
    return [channel for channel, _ in used], delays


def _windowed(
    used: Sequence[tuple[Channel, Vector]], rate: float
) -> tuple[Vector, list[tuple[ComplexMatrix, ComplexMatrix]]]:
    """(frequencies,) rad/s, and for each window the spectra of a_base'' and every slope, and of every acceleration."""
    accelerations = np.array(
        [own if channel.quantity == "acceleration" else second_derivative(own, rate) for channel, own in used]
    )
    slopes = np.gradient(accelerations, axis=1) * rate
    rows = np.vstack([np.gradient(slopes[0]) * rate, slopes, accelerations])
    length = round(WINDOW * rate)
    frequency, windows = hann_spectra(np.zeros((1, length)), rate, BAND).frequency, []
    for start in range(0, rows.shape[1] - length + 1, length // 2):
        piece = rows[:, start : start + length]
        spectra = hann_spectra(piece - piece.mean(axis=1, keepdims=True), rate, BAND).values
        windows.append((spectra[: -len(used)], spectra[-len(used) :]))
    return np.asarray(2 * np.pi * frequency), windows


def _floor_delay(ω: Vector, own: ComplexVector, slope: ComplexVector, base: ComplexMatrix) -> float:
    """s, delay τ of a level above the isolators relative to the base slab; NaN where it is uncertain.

    Least squares of a = p a_base + γ a_base'' − τ a', where p and γ are the quasi-static deflection. The derivatives
    are taken before the window is applied, which would turn growing motion into delay.
    """
    delay = 0.0
    for _ in range(ROUNDS + 1):
        moved, along = np.array([own, slope]) * np.exp(1j * ω * delay)
        columns = np.vstack([base, along])
        gram = (columns @ columns.conj().T).real
        solution = np.linalg.lstsq(gram, (columns.conj() @ moved).real, rcond=None)[0]
        delay -= solution[2]
    residual = moved - solution @ columns
    left, power = np.vdot(residual, residual).real, np.vdot(own, own).real
    variance = left / (2 * ω.size - 3) * np.linalg.pinv(gram)[2, 2]
    return float(delay) if left < UNEXPLAINED * power and variance < LARGEST_STD**2 else float("nan")


def _layer_delays(ω: Vector, base: ComplexVector, ground: ComplexVector, layer: ComplexVector) -> tuple[float, float]:
    """s, delays of the ground and of the layer's displacement relative to the base slab; NaN where uncertain.

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
    certain = left < UNEXPLAINED * np.vdot(layer, layer).real and (variance < LARGEST_STD**2).all()
    return (float(delays[0]), float(delays[1])) if certain else (float("nan"), float("nan"))
