"""One motion for each level from all sensors, and the channels that contradict the others.

Well below the first fixed-base frequency all levels above the isolators move nearly together, higher ones slightly
more (the quasi-static deflection of a shear building grows with height), and the layer's displacement is the difference
of the motion above and below it. A channel that is reversed, swapped, late or in another unit contradicts this.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Mask, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.record import Channel, Direction, Finding, Record
from core.sensors.agreement import GAIN, LEFT_OUT, Fault, against, low_spectra
from core.sensors.clock import clock_faults, one_body, one_body_below
from core.sensors.orientation import along_described_axes, oriented
from core.sensors.rigid import RigidLevels, rigid_levels, unlike_neighbours

KEPT = ("delay", "clock", "neighbour")
"""Kinds of finding with which a channel remains in use."""
CERTAIN_ORDER = 5.0
"""Standard deviations by which a lower level must move more than a higher one to be out of order. Not tuned."""
MOST_DEFLECTION = 1.5
"""Quasi-static deflection over the base slab's motion at the highest frequency, at most: that of a roof whose first
fixed-base frequency is 1 Hz."""
UNLIKE = 0.05
"""Share of the motion of the layer's sides by which gains and low-frequency noise may make two sensors differ. A
choice."""


def reconciled(record: Record, description: BuildingDescription) -> RigidLevels:
    """One motion for each level, quantity and direction, along the building's axes, from the channels that agree.

    Args:
        record: complete channels relative to their position at rest.
        description: of the building.

    Returns:
        With a finding for each channel that was corrected or left out.
    """
    along, lost = along_described_axes(record, description)
    unlike = unlike_neighbours(along, description)
    levels = rigid_levels(_without(along, unlike))
    turned_back, turned = oriented(levels.record, description)
    wrong = disagreements(turned_back, description)
    findings = (*lost, *unlike, *levels.findings, *turned, *wrong)
    return RigidLevels(_without(turned_back, wrong), levels.torsion, findings)


def _without(record: Record, findings: tuple[Finding, ...]) -> Record:
    """The record without the channels of these findings, except for KEPT."""
    left_out = {finding.channel for finding in findings if finding.kind not in KEPT}
    kept = [row for row, channel in enumerate(record.channels) if channel.id not in left_out]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=record.samples[kept])


@dataclass(frozen=True, slots=True, eq=False)
class _Spectra:
    """Low-frequency accelerations of one direction's channels; a displacement is differentiated twice."""

    channels: tuple[Channel, ...]
    """Channels that are clear above their noise: ground, base slab and floors upward, then the displacement."""
    values: ComplexMatrix
    """(channels, frequencies)."""
    noise: Vector
    """(channels,) expected power of the noise alone."""
    frequency: Vector
    """(frequencies,) Hz."""
    levels: Mapping[str, int]
    """Place of each level: 0 for the ground, 1 for the base slab."""
    low: Mask
    """(frequencies,) True where the levels above the isolators move as one body."""
    below: float
    """Hz, highest frequency at which they do."""

    def acceleration(self, place: int) -> ComplexVector | None:
        """(frequencies,) acceleration of the level at that place, or None."""
        for channel, row in zip(self.channels, self.values, strict=True):
            if channel.quantity == "acceleration" and self.levels[channel.level] == place:
                return row
        return None


def disagreements(record: Record, description: BuildingDescription) -> tuple[Finding, ...]:
    """Channels that contradict the others: reversed, swapped, late or in another unit.

    If reversing one channel, or swapping two, makes all agree, that is reported; otherwise every channel that
    disagrees. Channels that are too weak at low frequencies are not judged.

    Args:
        record: complete channels relative to their position at rest.
        description: of the building.
    """
    directions = [_spectra(record, description, direction) for direction in description.horizontal_directions]
    known = [spectra for spectra in directions if spectra is not None]
    faults = _swapped_across(known) or [fault for spectra in known for fault in _explained(spectra)]
    wrong = {fault.channel.direction for fault in faults}
    findings = [fault.finding(description) for fault in faults]
    for spectra in known:
        direction = spectra.channels[0].direction if spectra.channels else None
        findings += _not_compared(spectra)
        if direction is not None and direction not in wrong:
            findings += clock_faults(record, description, direction, spectra.channels)
    return tuple(findings)


def _not_compared(spectra: _Spectra) -> Iterator[Finding]:
    """A note where floors cannot be compared with the base slab: the building is too tall for so short a record."""
    floors = [one for one in spectra.channels if one.quantity == "acceleration" and spectra.levels[one.level] > 1]
    if floors and not spectra.low.any():
        message = (
            f"direction {floors[0].direction}: the floors' sensors were not compared with the base slab's: so tall a "
            f"building moves as one body below {spectra.below:.2g} Hz only, where this record says too little"
        )
        yield Finding("tall", "note", message)


def _spectra(record: Record, description: BuildingDescription, direction: Direction) -> _Spectra | None:
    levels = {level.name: place for place, level in enumerate(description.levels)}
    rows = [i for i, c in enumerate(record.channels) if c.direction == direction and c.quantity != "velocity"]
    rows = [i for i in rows if record.channels[i].quantity == "acceleration" or levels[record.channels[i].level] == 1]
    rows.sort(key=lambda i: (record.channels[i].quantity == "displacement", levels[record.channels[i].level]))
    if not rows:
        return None
    try:
        low = low_spectra(record.samples[rows], record.rate)
    except RecordError:  # too short to estimate its noise: no channel is judged
        return None
    low = low.accelerations([record.channels[i].quantity for i in rows])
    kept = [record.channels[i] for i, usable in zip(rows, low.clear, strict=True) if usable]
    return _Spectra(
        tuple(kept),
        low.values[low.clear],
        low.noise[low.clear].sum(axis=1),
        low.frequency,
        levels,
        one_body(low.frequency, description),
        one_body_below(description),
    )


def _swapped_across(known: list[_Spectra]) -> list[Fault]:
    """The two channels of different directions whose exchange makes all agree, if both directions disagree."""
    if len(known) < 2 or not all(any(_disagreeing(spectra)) for spectra in known):
        return []
    one, other = known
    for i, j in product(range(len(one.channels)), range(len(other.channels))):
        if one.channels[i].quantity != other.channels[j].quantity:
            continue
        here, there = one.values.copy(), other.values.copy()
        here[i], there[j] = other.values[j], one.values[i]
        if not any(_disagreeing(replace(one, values=here))) and not any(_disagreeing(replace(other, values=there))):
            return _swapped(one.channels[i], other.channels[j])
    return []


def _explained(spectra: _Spectra) -> list[Fault]:
    """The fewest faults that explain a disagreement: one channel reversed, two swapped, or each by itself."""
    faults = [*_disagreeing(spectra)]
    if not faults:
        return []
    for i, channel in enumerate(spectra.channels):
        sign = np.ones((len(spectra.channels), 1))
        sign[i] = -1
        if not any(_disagreeing(replace(spectra, values=sign * spectra.values))):
            message = "moves opposite to all others: its polarity is reversed. Reverse its sign and analyse again"
            return [Fault("reversed", channel, -1.0, message)]
    for i, j in combinations(range(len(spectra.channels)), 2):
        order = np.arange(len(spectra.channels))
        order[[i, j]] = j, i
        if spectra.channels[i].quantity == spectra.channels[j].quantity and not any(
            _disagreeing(replace(spectra, values=spectra.values[order]))
        ):
            return _swapped(spectra.channels[i], spectra.channels[j])
    return faults


def _swapped(one: Channel, other: Channel) -> list[Fault]:
    return [
        Fault(
            "swapped",
            channel,
            1.0,
            f"moves as {second.id} should, and that one as this: they are swapped. Correct the building file",
        )
        for channel, second in ((one, other), (other, one))
    ]


def _disagreeing(spectra: _Spectra) -> Iterator[Fault]:
    base = spectra.acceleration(1)
    if base is None:
        return
    if spectra.low.any():
        yield from _floors(_below(spectra), base[spectra.low])
    yield from _layer(spectra, base)


def _below(spectra: _Spectra) -> _Spectra:
    """The spectra where the levels above the isolators move as one body."""
    low = spectra.low
    return replace(spectra, values=spectra.values[:, low], frequency=spectra.frequency[low], low=low[low])


def _floors(spectra: _Spectra, base: ComplexVector) -> Iterator[Fault]:
    floors = [c for c in spectra.channels if c.quantity == "acceleration" and spectra.levels[c.level] > 1]
    right = []
    for channel in floors:
        floor = spectra.acceleration(spectra.levels[channel.level])
        if floor is not None:
            expected = _deflected(spectra.frequency, base, floor)
            faults = [*against(channel, floor, expected, "the base slab", below=spectra.below)]
            yield from faults
            right += [] if faults else [channel]
    yield from _out_of_order(spectra, base, right)


def _deflected(frequency: Vector, base: ComplexVector, floor: ComplexVector) -> ComplexVector:
    """(frequencies,) motion of the base slab with the quasi-static deflection that brings it nearest to a floor's.

    Below resonance a floor moves 1 + κ (f / f_top)² times as much, with a limited κ ≥ 0.
    """
    shape = (frequency / frequency[-1]) ** 2
    motions = [(1 + κ * shape) * base for κ in np.linspace(0, MOST_DEFLECTION, 13)]
    gains = [abs(np.vdot(motion, floor).real) / np.vdot(motion, motion).real for motion in motions]
    nearest: ComplexVector = motions[int(np.argmin(np.abs(np.log(np.maximum(gains, np.finfo(float).tiny)))))]
    return nearest


def _out_of_order(spectra: _Spectra, base: ComplexVector, floors: list[Channel]) -> Iterator[Fault]:
    """Levels that deflect less than one below them: every storey's drift is in phase with −(acceleration)."""
    deflection = (2 * np.pi * spectra.frequency) ** 2 * base
    lower = base
    for channel in floors:
        higher = spectra.acceleration(spectra.levels[channel.level])
        if higher is None:
            continue
        drift = higher - lower
        slope = np.vdot(deflection, drift).real / np.vdot(deflection, deflection).real
        residual = drift - slope * deflection
        spread = np.sqrt(np.vdot(residual, residual).real / np.vdot(deflection, deflection).real / drift.size)
        if slope < -CERTAIN_ORDER * spread:
            message = "moves less than a level below it: two levels may be swapped. Check the building file"
            yield Fault("swapped", channel, float(slope), f"{message}. {LEFT_OUT}")
        lower = higher


def _layer(spectra: _Spectra, base: ComplexVector) -> Iterator[Fault]:
    """The displacement, differentiated twice, against both sides: x'' = p a_base − q a_ground with p = q = 1."""
    ground = spectra.acceleration(0)
    across = [(c, row) for c, row in zip(spectra.channels, spectra.values, strict=True) if c.quantity == "displacement"]
    if ground is None or not across:
        return
    below = next(c for c in spectra.channels if c.quantity == "acceleration" and spectra.levels[c.level] == 0)
    channel, motion = across[0]
    sides = np.column_stack([base, -ground])
    noise = _noise_between(spectra, base, ground)
    (p, q), *_ = np.linalg.lstsq(sides, motion, rcond=None)
    if abs(p) > 0 and not 1 / GAIN < (q / p).real < GAIN and abs(p - 1) < 1 - 1 / GAIN:
        yield from against(below, ground, base - motion, "base slab minus displacement of the layer")
    else:
        yield from against(channel, motion, base - ground, "base slab minus ground", noise=noise)


def _noise_between(spectra: _Spectra, base: ComplexVector, ground: ComplexVector) -> float:
    """Power in the difference of the layer's sides that comes from noise and from unlike sensors."""
    noise = sum(
        power
        for channel, power in zip(spectra.channels, spectra.noise, strict=True)
        if channel.quantity == "acceleration" and spectra.levels[channel.level] in {0, 1}
    )
    motion = np.vdot(base, base).real + np.vdot(ground, ground).real
    return float(noise + UNLIKE**2 * motion)
