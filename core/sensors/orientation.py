"""Whose axes are turned against the building's?

Above the isolators every sensor of two axes is compared with the base slab's; the one that stands apart is turned,
and if all stand apart alike it is the base slab's own. The ground is compared with what base slab and displacement
transducers say of it, or, without transducers, with the base slab itself, which leaves open whether its axes are
reversed besides. Nothing tells whether all are turned alike, and nothing is said where the motion lay along one line.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Matrix
from core.description import BuildingDescription
from core.quality import Finding
from core.record import Channel, Direction, Quantity, Record
from core.rounding import with_std
from core.sensors.azimuth import RelativeAngle, relative_angle, turned_back
from core.sensors.screening import loss

TURNED = np.deg2rad(3.0)
"""rad: smaller angles are mounting; of the other direction's motion a twentieth is then read."""
CERTAIN = 5.0
"""Standard deviations by which an angle must exceed 0."""
ALIKE = np.deg2rad(3.0)
"""rad, within which all others stand to the base slab alike."""
FEWEST_FLOORS = 2
"""Sensors above that it takes to say that the base slab's is the one that is turned."""


@dataclass(frozen=True, slots=True)
class _Turn:
    """By how much a sensor's axes are turned."""

    angle: float
    """rad in (−π, π], from x towards y."""
    std: float
    mirrored: bool
    """Whether y is reversed besides."""

    @property
    def counts(self) -> bool:
        """Whether it is more than mounting, and more than whole axes reversed or exchanged: their names say it all."""
        whole = np.pi / 2 if self.mirrored else np.pi
        beside = abs((self.angle + whole / 2) % whole - whole / 2)
        return bool(beside > max(TURNED, CERTAIN * self.std))

    @property
    def upright(self) -> bool:
        """Whether the two sensors compared agree, so that other sensors may be judged by them."""
        return not self.mirrored and abs(self.angle) < TURNED


Pair = tuple[tuple[Channel, Channel], Matrix]
"""The x and y channels of a sensor, and (2, n) what they measured."""


def oriented(record: Record, description: BuildingDescription) -> tuple[Record, tuple[Finding, ...]]:
    """The record along the building's axes, and a warning for every channel whose axes were turned by 3 degrees.

    Axes that are turned are turned back; a sensor that is turned and mirrored is left out. One that is only mirrored,
    or whose x and y are only exchanged, is left to `core.sensors.consistency`, which names it more simply.

    Args:
        record: complete channels about their position at rest, one for each level, quantity and direction.
        description: of the building.
    """
    samples, lost, found = record.samples.copy(), set[Channel](), list[Finding]()
    for (channels, _), turn in _turned(_pairs(record), description, record.rate):
        rows = [record.channels.index(channel) for channel in channels]
        if turn.mirrored:
            lost.update(channels)
        else:
            samples[rows] = turned_back(samples[rows], turn.angle)
        found += [_finding(channel, turn, description) for channel in channels]
    kept = [row for row, channel in enumerate(record.channels) if channel not in lost]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=samples[kept]), tuple(found)


def along_described_axes(record: Record, description: BuildingDescription) -> tuple[Record, tuple[Finding, ...]]:
    """The record along the building's axes as far as the description says how its sensors are turned.

    A channel whose other axis is missing cannot be turned back and is left out.

    Args:
        record: complete channels about their position at rest, any number for each level and direction.
        description: of the building.
    """
    samples, found = record.samples.copy(), list[Finding]()
    for row, channel in enumerate(record.channels):
        if not channel.rotation:
            continue
        other = _other_axis(record, channel)
        if other is None:
            message = "its axes are turned; without the sensor's other axis it cannot be turned back and is left out"
            found.append(Finding("rotation", loss(channel, description), message, channel.id, channel.rotation))
        elif channel.direction == "x":
            samples[[row, other]] = turned_back(record.samples[[row, other]], channel.rotation)
    lost = {finding.channel for finding in found}
    kept = [row for row, channel in enumerate(record.channels) if channel.id not in lost]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=samples[kept]), tuple(found)


def _other_axis(record: Record, channel: Channel) -> int | None:
    """Row of the channel that is the same sensor's other horizontal axis."""
    direction: Direction = "y" if channel.direction == "x" else "x"
    wanted = replace(channel, direction=direction)
    return next((row for row, one in enumerate(record.channels) if replace(one, id=channel.id) == wanted), None)


def _turned(
    pairs: Mapping[tuple[str, Quantity], Pair], description: BuildingDescription, rate: float
) -> list[tuple[Pair, _Turn]]:
    """The sensors that are turned."""
    base, ground, layer = (
        pairs.get((description.base.name, "acceleration")),
        pairs.get((description.ground.name, "acceleration")),
        pairs.get((description.base.name, "displacement")),
    )
    if base is None:
        return []
    floors = [pairs[f.name, "acceleration"] for f in description.floors if (f.name, "acceleration") in pairs]
    known = [(pair, turn) for pair in floors if (turn := _turn(base[1], pair[1], rate)) is not None]
    above = [turn for _, turn in known]
    if ground is not None and (not above or any(turn.upright for turn in above)):
        of_ground = _of_ground(base[1], ground[1], layer, rate)
        known += [] if of_ground is None else [(ground, of_ground)]
    own = _of_base(above)
    if own is not None:
        return [(base, own)]
    turned = [(pair, turn) for pair, turn in known if turn.counts]
    if layer is not None and ground is not None and not turned:
        turn = _turn(base[1] - ground[1], _twice_differentiated(layer[1], rate), rate)
        turned = [(layer, turn)] if turn is not None and turn.counts else []
    return turned


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


def _turn(reference: Matrix, sensor: Matrix, rate: float) -> _Turn | None:
    """Of a sensor that moves with the reference, so that its signs count as well."""
    found = relative_angle(reference, sensor, rate)
    return None if found is None else _signed(found)


def _signed(found: RelativeAngle) -> _Turn:
    x, y = found.signs
    mirrored = x != y
    angle = (-found.angle if mirrored else found.angle) + (np.pi if x < 0 else 0.0)
    return _Turn(float(np.pi - (np.pi - angle) % (2 * np.pi)), found.std, mirrored)


def _of_ground(base: Matrix, ground: Matrix, layer: Pair | None, rate: float) -> _Turn | None:
    if layer is not None:
        return _turn(base - _twice_differentiated(layer[1], rate), ground, rate)
    found = relative_angle(base, ground, rate)  # across the layer signs say nothing
    return None if found is None else _signed(replace(found, signs=(1.0, 1.0)))


def _twice_differentiated(displacement: Matrix, rate: float) -> Matrix:
    return np.asarray(np.gradient(np.gradient(displacement, axis=1), axis=1) * rate**2)


def _of_base(others: list[_Turn]) -> _Turn | None:
    """How the base slab's own sensor is turned: opposite to all others, if they agree."""
    if len(others) < FEWEST_FLOORS or not all(turn.counts for turn in others):
        return None
    first = others[0]
    apart = [(turn.angle - first.angle + np.pi) % (2 * np.pi) - np.pi for turn in others]
    if any(turn.mirrored != first.mirrored for turn in others) or max(np.abs(apart)) > ALIKE:
        return None
    angle = first.angle + float(np.mean(apart))
    # what undoes a turn is the opposite turn, what undoes a turned mirror is that mirror
    return _Turn(angle if first.mirrored else -angle, min(turn.std for turn in others), first.mirrored)


def _finding(channel: Channel, turn: _Turn, description: BuildingDescription) -> Finding:
    degrees, std = np.rad2deg([turn.angle, turn.std]).tolist()
    turned = f"its axes are turned by {with_std(degrees, std)} degrees from x towards y against the other sensors'"
    if turn.mirrored:
        message = f"{turned} and mirrored. It is left out; turn the sign of its y, and see what is left of the angle"
        return Finding("rotation", loss(channel, description), message, channel.id, turn.angle)
    advice = f"rotation = {degrees:.0f} for its x and y in the building file does so for good"
    return Finding("rotation", "warning", f"{turned}; they were turned back; {advice}", channel.id, turn.angle)
