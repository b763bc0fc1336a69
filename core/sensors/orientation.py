"""Orientation of the sensors' horizontal axes relative to the building's, estimated and corrected.

Along each of the building's axes every level responds to the motion of the base slab along that axis alone, whatever
its transfer function. Of all angles by which a sensor's record can be turned back, the right one therefore leaves the
smallest residual of such a pair of transfer functions: the record is then most coherent with the reference.

Above the isolators every sensor of two axes is compared with the base slab's; the one that differs is turned, and if
all differ alike it is the base slab's own. All floors together decide between the two, also those that do not
determine an angle alone. The ground is compared with the difference of base slab and displacement transducers, or,
without transducers, with the base slab itself, which does not show whether its axes are reversed. No comparison shows
that all sensors are turned alike, and none is possible where the motion lay along one line.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, Matrix, Tensor, Vector
from core.description import BuildingDescription
from core.record import Channel, Direction, Finding, Quantity, Record
from core.rounding import with_std
from core.sensors.screening import loss
from core.signals.spectra import hann_spectra, second_derivative

BAND = (0.1, 1.0)
"""Hz, above the accelerometers' drift and below the coupled modes of the superstructure."""
BINS = 8
"""Lines of the spectrum over which a transfer function is constant. A choice: 0.1 Hz of 80 s."""
UNEXPLAINED = 0.2
"""Share of the sensor's power that may remain at the best angle. Not tuned."""
TURNED = np.deg2rad(3.0)
"""rad; smaller angles are mounting tolerance, with which a twentieth of the other direction's motion is read."""
ALIKE = np.deg2rad(3.0)
"""rad, difference within which two angles agree: of x and y alone, and of the floors relative to the base slab."""
LEAKED = 0.2
"""Share of the angle by which x and y alone may differ from it: a transfer function that changes within BINS lines
leaves 0.13 of the angle in the trials `rotation@1F` (seed 101), a torsion as much as the angle. A choice."""
LARGEST_STD = np.deg2rad(10.0)
"""rad, largest standard deviation of the angle from x or y alone. Not tuned."""
CERTAIN_ANGLE = 5.0
"""Standard deviations by which an angle must exceed 0. A choice (docs, decision 7)."""
FEWEST = 2
"""Fewest sensors that can show whether the base slab's own is turned."""
MOUNTED = np.deg2rad(1.0)
"""rad, standard deviation of the angle at which a sensor is mounted. A choice: a third of TURNED."""
DECIDED = 9.0
"""Difference of χ² by which the base slab's own sensor is turned rather than another: three standard deviations. A
choice."""

Pair = tuple[tuple[Channel, Channel], Matrix]
"""The x and y channels of a sensor, and (2, n) their samples."""


@dataclass(frozen=True, slots=True)
class RelativeAngle:
    """Angle between the axes of a sensor and those of a reference, up to their signs."""

    angle: float
    """rad in (−π/2, π/2], of the sensor's axes, from x towards y."""
    std: float
    """rad, standard deviation; large if the motion lay along one line."""
    signs: tuple[float, float]
    """For x and y, 1 if the turned record mostly moves with the reference, −1 if it moves against it."""
    is_certain: bool
    """True if x and y imply the angle each alone; otherwise only other sensors can confirm it."""


@dataclass(frozen=True, slots=True)
class _Turn:
    """Rotation of a sensor's axes."""

    angle: float
    """rad in (−π, π], from x towards y."""
    std: float
    mirrored: bool
    """True if y is reversed as well."""
    is_certain: bool = True
    """True if x and y imply the angle each alone."""

    @property
    def counts(self) -> bool:
        """True if it exceeds mounting tolerance, and is more than whole axes reversed or exchanged."""
        whole = np.pi / 2 if self.mirrored else np.pi
        beside = abs((self.angle + whole / 2) % whole - whole / 2)
        return bool(beside > max(TURNED, CERTAIN_ANGLE * self.std))

    @property
    def upright(self) -> bool:
        """True if the two sensors agree, so that others may be compared with them."""
        return not self.mirrored and max(abs(self.angle), self.std) < TURNED


def oriented(record: Record, description: BuildingDescription) -> tuple[Record, tuple[Finding, ...]]:
    """The record along the building's axes, and a warning for every channel whose axes are turned by 3 degrees or more.

    Turned axes are turned back; a sensor that is turned and mirrored is left out. One that is only mirrored, or whose x
    and y are only exchanged, is left to `core.sensors.reconciliation.disagreements`, whose message is simpler.

    Args:
        record: complete channels relative to their position at rest, one per level, quantity and direction.
        description: of the building.
    """
    samples, lost, findings = record.samples.copy(), set[Channel](), list[Finding]()
    for (channels, _), turn in _turned(_pairs(record), description, record.rate):
        rows = [record.channels.index(channel) for channel in channels]
        if turn.mirrored:
            lost.update(channels)
        else:
            samples[rows] = turned_back(samples[rows], turn.angle)
        findings += [_finding(channel, turn, description) for channel in channels]
    kept = [row for row, channel in enumerate(record.channels) if channel not in lost]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=samples[kept]), tuple(findings)


def along_described_axes(record: Record, description: BuildingDescription) -> tuple[Record, tuple[Finding, ...]]:
    """The record along the building's axes, by the rotations in the description.

    A channel whose other axis is missing cannot be turned back and is left out.

    Args:
        record: complete channels relative to their position at rest, any number per level and direction.
        description: of the building.
    """
    samples, findings = record.samples.copy(), list[Finding]()
    for row, channel in enumerate(record.channels):
        if not channel.rotation:
            continue
        other = _other_axis(record, channel)
        if other is None:
            message = "its axes are turned; without the sensor's other axis it cannot be turned back and is left out"
            findings.append(Finding("rotation", loss(channel, description), message, channel.id, channel.rotation))
        elif channel.direction == "x":
            samples[[row, other]] = turned_back(record.samples[[row, other]], channel.rotation)
    lost = {finding.channel for finding in findings}
    kept = [row for row, channel in enumerate(record.channels) if channel.id not in lost]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=samples[kept]), tuple(findings)


def turned_back(samples: Matrix, angle: float) -> Matrix:
    """(2, n) along the building's axes, from (2, n) along axes turned by an angle in rad, from x towards y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(np.array([[c, -s], [s, c]]) @ samples)


def _other_axis(record: Record, channel: Channel) -> int | None:
    """Row of the same sensor's other horizontal axis."""
    direction: Direction = "y" if channel.direction == "x" else "x"
    wanted = replace(channel, direction=direction)
    return next((row for row, one in enumerate(record.channels) if replace(one, id=channel.id) == wanted), None)


def _pairs(record: Record) -> Mapping[tuple[str, Quantity], Pair]:
    rows = {(c.level, c.quantity, c.direction): i for i, c in enumerate(record.channels)}
    return {
        (level, quantity): (
            (record.channels[x], record.channels[rows[level, quantity, "y"]]),
            record.samples[[x, rows[level, quantity, "y"]]],
        )
        for (level, quantity, direction), x in rows.items()
        if direction == "x" and (level, quantity, "y") in rows
    }


def _turned(
    pairs: Mapping[tuple[str, Quantity], Pair], description: BuildingDescription, rate: float
) -> list[tuple[Pair, _Turn]]:
    """The sensors that are turned. None, if those above the base slab leave open whether its own is."""
    base, ground, layer = (
        pairs.get((description.base.name, "acceleration")),
        pairs.get((description.ground.name, "acceleration")),
        pairs.get((description.base.name, "displacement")),
    )
    if base is None:
        return []
    floors = [pairs[f.name, "acceleration"] for f in description.floors if (f.name, "acceleration") in pairs]
    compared = [(pair, turn) for pair in floors if (turn := _turn(base[1], pair[1], rate)) is not None]
    above = [turn for _, turn in compared]
    of_ground = None if ground is None else _ground_turn(base[1], ground[1], layer, rate)
    own = _base_turn(above)
    if own is not None:
        return [(base, own)]
    known = [(pair, turn) for pair, turn in compared if turn.is_certain]
    of_layer = None
    if layer is not None and ground is not None:
        of_layer = _turn(base[1] - ground[1], second_derivative(layer[1], rate), rate)
    beside = of_ground if layer is None else of_layer
    witnesses = [turn for _, turn in known] + ([beside] if beside is not None and beside.is_certain else [])
    is_upright = any(turn.upright for turn in witnesses) or _of_base(above) - _of_one(above) > DECIDED
    if len(floors) + (beside is not None) >= FEWEST and not is_upright:
        return []  # it may be the base slab's own sensor, with which all were compared
    if ground is not None and of_ground is not None and of_ground.is_certain and (is_upright or not known):
        known.append((ground, of_ground))
    turned = [(pair, turn) for pair, turn in known if turn.counts]
    if layer is not None and of_layer is not None and of_layer.is_certain and of_layer.counts and not turned:
        return [(layer, of_layer)]
    return turned


def _turn(reference: Matrix, sensor: Matrix, rate: float) -> _Turn | None:
    """Rotation of a sensor that moves with the reference, so that its signs count."""
    angle = relative_angle(reference, sensor, rate)
    return None if angle is None else _signed(angle)


def _signed(measured: RelativeAngle) -> _Turn:
    x, y = measured.signs
    mirrored = x != y
    angle = (-measured.angle if mirrored else measured.angle) + (np.pi if x < 0 else 0.0)
    return _Turn(float(np.pi - (np.pi - angle) % (2 * np.pi)), measured.std, mirrored, measured.is_certain)


def _ground_turn(base: Matrix, ground: Matrix, layer: Pair | None, rate: float) -> _Turn | None:
    if layer is not None:
        return _turn(base - second_derivative(layer[1], rate), ground, rate)
    angle = relative_angle(base, ground, rate)  # across the layer, signs have no meaning
    return None if angle is None else _signed(replace(angle, signs=(1.0, 1.0)))


def _base_turn(floors: Sequence[_Turn]) -> _Turn | None:
    """Rotation of the base slab's own sensor: opposite to all floors' if it explains them better than one of theirs."""
    if len(floors) < FEWEST or not any(turn.is_certain for turn in floors):
        return None
    first = floors[0]
    angle, apart = _common(floors)
    if any(turn.mirrored != first.mirrored for turn in floors):
        return None
    if any(abs(beside) > ALIKE + 3 * turn.std for beside, turn in zip(apart, floors, strict=True)):
        return None
    std = float(np.sum([turn.std**-2.0 for turn in floors]) ** -0.5)
    # the inverse of a turn is the opposite turn; a turned mirror is its own inverse
    own = _Turn(angle if first.mirrored else -angle, std, first.mirrored)
    return own if own.counts and _of_one(floors) - _of_base(floors) > DECIDED else None


def _common(turns: Sequence[_Turn]) -> tuple[float, Vector]:
    """The mean angle of several sensors, and what each is apart from it, rad in [−π, π)."""
    weights = np.array([1 / _variance(turn) for turn in turns])
    nearest = turns[int(np.argmax(weights))].angle
    apart = (np.array([turn.angle for turn in turns]) - nearest + np.pi) % (2 * np.pi) - np.pi
    mean = float(weights @ apart / weights.sum())
    return nearest + mean, apart - mean


def _variance(turn: _Turn) -> float:
    """rad², of a sensor that was mounted with a tolerance."""
    return float(turn.std**2 + MOUNTED**2)


def _of_one(turns: Sequence[_Turn]) -> float:
    """χ² of sensors if the most turned of them alone is turned."""
    return sum(sorted(turn.angle**2 / _variance(turn) for turn in turns)[:-1])


def _of_base(turns: Sequence[_Turn]) -> float:
    """χ² of sensors if the base slab's is turned, with which they were compared."""
    if not turns:
        return 0.0
    _, apart = _common(turns)
    return float(sum(beside**2 / _variance(turn) for beside, turn in zip(apart, turns, strict=True)))


def _finding(channel: Channel, turn: _Turn, description: BuildingDescription) -> Finding:
    degrees, std = np.rad2deg([turn.angle, turn.std]).tolist()
    turned = f"its axes are turned by {with_std(degrees, std)} degrees from x towards y relative to the other sensors'"
    if turn.mirrored:
        message = f"{turned} and mirrored. The channel is left out; reverse the sign of its y and analyse again"
        return Finding("rotation", loss(channel, description), message, channel.id, turn.angle)
    advice = f"to make this permanent, set rotation = {degrees:.0f} for its x and y in the building file"
    return Finding("rotation", "warning", f"{turned}; they were turned back; {advice}", channel.id, turn.angle)


def relative_angle(reference: Matrix, sensor: Matrix, rate: float) -> RelativeAngle | None:
    """Angle of a sensor's axes relative to those of a reference.

    The cost of the angle φ is A cos²φ + B sin²φ − 2 C cosφ sinφ, whose minimum has a closed form. Its standard
    deviation is the larger of those from the cost's curvature and from its slopes over the parts of the spectrum; the
    latter holds where the transfer functions miss more than noise (a nonlinear layer).

    Args:
        reference: (2, n) x and y of the reference.
        sensor: (2, n) x and y of the sensor, of the same quantity.
        rate: Hz.

    Returns:
        None if the record is too short, no angle makes the two coherent, or x and y imply different angles, which they
        do for a sensor off the centre of a torsion.
    """
    R, S = _blocks(reference, rate), _blocks(sensor, rate)
    power = float(np.sum(np.abs(S) ** 2))
    if R.shape[1] < 2 or not power > 0:
        return None
    φ, std, least = _least(_costs(R, S))
    turned = np.cos(φ) * S + np.sin(φ) * np.array([-S[1], S[0]])
    if not (np.isfinite(std) and least < UNEXPLAINED * power):
        return None
    leaked, spread = _leaked(R, turned)
    if (np.abs(leaked) > np.maximum(max(ALIKE, LEAKED * abs(φ)), 3 * spread)).any():
        return None
    x, y = np.sign(np.sum((turned * R.conj()).real, axis=(1, 2)))
    return RelativeAngle(φ, std, (float(x), float(y)), bool((spread <= LARGEST_STD).all()))


def _blocks(samples: Matrix, rate: float) -> ComplexTensor:
    """(2, blocks, BINS) spectrum of x and y within the band."""
    spectra = hann_spectra(samples, rate, BAND).values
    return np.asarray(spectra[:, : spectra.shape[1] // BINS * BINS].reshape(2, -1, BINS))


def _costs(R: ComplexTensor, S: ComplexTensor) -> Tensor:
    """(3, 2, blocks) A, B and C: residuals of S_x cosφ − S_y sinφ from R_x, and of S_x sinφ + S_y cosφ from R_y."""
    (xx, yx), (xy, yy) = [[_residual(R[axis], own) for own in S] for axis in range(2)]
    power = [[np.sum(np.abs(own) ** 2, axis=1) for own in axis] for axis in ((xx, yy), (yx, xy))]
    mixed = [np.sum((xx * yx.conj()).real, axis=1), -np.sum((xy * yy.conj()).real, axis=1)]
    return np.array([*power, mixed])


def _least(costs: Tensor) -> tuple[float, float, float]:
    """The best angle in rad, its standard deviation and the remaining cost, from (3, axes, blocks) A, B and C."""
    A, B, C = costs
    difference, mixed = float((B - A).sum()) / 2, float(C.sum())
    depth = float(np.hypot(difference, mixed))
    if depth == 0:
        return 0.0, np.inf, 0.0
    φ = float(np.arctan2(mixed, difference)) / 2
    least = max(float((A + B).sum()) / 2 - depth, 0.0)
    slopes = (B - A) / 2 * np.sin(2 * φ) - C * np.cos(2 * φ)
    free = 2 * A.size * (BINS - 1) - 1
    variance = max(least / free / (2 * depth), float(np.sum(slopes**2)) / (2 * depth) ** 2)
    return φ, float(np.sqrt(variance)), least


def _leaked(R: ComplexTensor, turned: ComplexTensor) -> tuple[Vector, Vector]:
    """(2,) rad by which the angles that x and y imply alone differ from the common one, and their standard deviations.

    Each implies its angle by its share of the other axis, once both are turned by the common angle.
    """
    leaked, std = np.empty(2), np.empty(2)
    for axis in range(2):
        own, other = (_residual(R[axis], turned[one]) for one in (axis, 1 - axis))
        power = max(float(np.sum(np.abs(other) ** 2)), np.finfo(float).tiny)
        by_block = np.sum((own * other.conj()).real, axis=1)
        leaked[axis] = float(by_block.sum()) / power
        left = by_block - leaked[axis] * np.sum(np.abs(other) ** 2, axis=1)
        std[axis] = float(np.sqrt(np.sum(left**2))) / power
    return leaked, std


def _residual(reference: ComplexMatrix, own: ComplexMatrix) -> ComplexMatrix:
    """(blocks, BINS) remainder that no constant transfer function makes of the reference."""
    power = np.sum(np.abs(reference) ** 2, axis=1, keepdims=True)
    cross = np.sum(own * reference.conj(), axis=1, keepdims=True)
    return np.asarray(own - cross / np.maximum(power, np.finfo(float).tiny) * reference)
