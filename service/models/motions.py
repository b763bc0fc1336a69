"""Ground motions for forecasts: from files, and their scaling as people write it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.arrays import Vector
from core.errors import RecordError
from core.forecasting.ground_motion import GroundMotion, Scaling, ToDisplacement, ToPga, ToSpectrum
from core.record import Direction, Quantity
from service.buildings.description import BuildingFile
from service.formats import Contents, FormatError, Trace, UnknownUnitError, read
from service.formats.trace import RATES, overlapping
from service.formats.units import unit_gain

COMPONENTS: Mapping[str, Direction] = {
    "X": "x", "E": "x", "1": "x", "Y": "y", "N": "y", "2": "y", "Z": "z", "U": "z", "3": "z",
}  # fmt: skip
"""Direction by the last letter of a channel code, for motions from elsewhere: east is x, north is y."""
SIZE = re.compile(r"\s*([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|[-+]?\.\d+)\s*(.*?)\s*")
"""A number and its unit."""


@dataclass(frozen=True, slots=True, eq=False)
class Component:
    """One component of a ground motion, from one file."""

    name: str
    """Name of the file, without its suffix."""
    station: str
    """Network and station, which components of one motion share."""
    direction: Direction
    trace: Trace


def motions(paths: Sequence[Path], building: BuildingFile) -> tuple[GroundMotion, ...]:
    """The ground motions in some files, in the order of the files.

    A file is one motion; files of single components of one station at one time, such as those of K-NET, are one
    together. Of the building's own records the ground's accelerations are taken, of others every acceleration, by the
    last letter of its channel code.

    Args:
        paths: files of any format.
        building: the building.

    Raises:
        FormatError: a file that cannot be used, or without the acceleration of the ground.
        RecordError: components that do not make a motion.
        OSError: a file that cannot be opened.
    """
    groups: list[list[Component]] = []
    for path in paths:
        own = of_file(path.stem, path.name, path.read_bytes(), building)
        joined = next((group for group in groups if _together(group, own)), None)
        if joined is None:
            groups.append(list(own))
        else:
            joined.extend(own)
    return tuple(motion(group) for group in groups)


def of_file(stem: str, name: str, data: bytes, building: BuildingFile) -> tuple[Component, ...]:
    """Components of ground motions in a file; errors as of `motions`."""
    return of_contents(stem, name, read(name, data, building.gains), building)


def of_contents(stem: str, name: str, contents: Contents, building: BuildingFile) -> tuple[Component, ...]:
    """Components of ground motions in the contents of a file; errors as of `motions`."""
    ground = {
        channel.id: channel.direction
        for channel in building.description.channels
        if channel.level == building.description.ground.name and channel.quantity == "acceleration"
    }
    own = [trace for trace in contents.traces if trace.channel in ground]
    if not own and any(trace.channel in _ids(building) for trace in contents.traces):
        raise FormatError(f"{name}: it has records of the building, but none of the ground's acceleration")
    wanted: Quantity = "acceleration"
    chosen = own or [trace for trace in contents.traces if trace.quantity == wanted]
    if not chosen:
        if contents.without_unit:
            raise UnknownUnitError(contents.without_unit)
        raise FormatError(f"{name}: it has no acceleration; a forecast needs the acceleration of the ground")
    return tuple(
        Component(stem, _station(trace), ground.get(trace.channel) or _direction(name, trace), trace)
        for trace in chosen
    )


def motion(components: Sequence[Component]) -> GroundMotion:
    """The motion of some components, over the time that all of them have; errors as of `motions`."""
    name = components[0].name
    by_direction: dict[Direction, Trace] = {}
    for one in components:
        if one.direction in by_direction:
            raise FormatError(
                f"{name}: {by_direction[one.direction].channel} and {one.trace.channel} are both of direction "
                f"{one.direction}, or one has a gap; keep one continuous series of each direction"
            )
        by_direction[one.direction] = one.trace
    rates = sorted({trace.rate for trace in by_direction.values()})
    low, high = RATES["acceleration"]
    if len(rates) > 1 or not low <= rates[0] <= high:
        listed = ", ".join(f"{rate:g}" for rate in rates)
        raise FormatError(
            f"{name}: it has {listed} samples a second; all components need the same, {low:g} to {high:g}"
        )
    return GroundMotion(name, rates[0], _common(name, by_direction))


def _common(name: str, traces: Mapping[Direction, Trace]) -> dict[Direction, Vector]:
    """The samples in m/s² of the time that all components have."""
    start, end = max(one.span[0] for one in traces.values()), min(one.span[1] for one in traces.values())
    cut = {direction: trace.cut(start, end) for direction, trace in traces.items()}
    pieces = {direction: one.to_si() for direction, one in cut.items() if one is not None}
    if len(pieces) < len(traces):
        raise RecordError(f"{name}: its components have no time in common")
    count = min(one.size for one in pieces.values())
    return {direction: np.asarray(one[:count]) for direction, one in pieces.items()}


def _together(group: Sequence[Component], own: Sequence[Component]) -> bool:
    """True if the components complete a motion: another direction of the same station at the same time."""
    directions = {one.direction for one in group}
    stations = {one.station for one in (*group, *own)}
    return (
        len(stations) == 1
        and not directions & {one.direction for one in own}
        and len(overlapping([one.trace for one in (*group, *own)], lambda trace: trace.span)) == 1
    )


def _ids(building: BuildingFile) -> set[str]:
    return {channel.id for channel in building.description.channels}


def _station(trace: Trace) -> str:
    return ".".join(trace.channel.split(".")[:2])


def _direction(name: str, trace: Trace) -> Direction:
    known = COMPONENTS.get(trace.channel[-1:].upper())
    if known is None:
        raise FormatError(
            f"{name}: the direction of {trace.channel} is not known; end its channel code with X, Y or Z, or with E, N "
            "or Z, where east is x and north is y"
        )
    return known


def scaling(pga: str | None, displacement: str | None, design_spectrum: bool, building: BuildingFile) -> Scaling | None:
    """The scaling that people ask for; None for motions as they are.

    Args:
        pga: peak ground acceleration, such as `400 gal`; a number alone is in m/s².
        displacement: of the isolators, such as `300 mm`; a number alone is in m.
        design_spectrum: True for the design spectrum of the building file.
        building: the building.

    Raises:
        RecordError: more than one is given, a value or unit is wrong, or the building file has no design spectrum.
    """
    given = [one for one in (pga, displacement, design_spectrum or None) if one is not None]
    if len(given) > 1:
        raise RecordError(
            "a motion is scaled to one thing: to a peak acceleration, a displacement or the design spectrum"
        )
    if pga is not None:
        return ToPga(size(pga, "acceleration", "m/s**2"))
    if displacement is not None:
        return ToDisplacement(size(displacement, "displacement", "m"))
    if not design_spectrum:
        return None
    if building.design_spectrum is None:
        raise RecordError("the building file has no [design_spectrum]; add it, or scale to something else")
    return ToSpectrum(building.design_spectrum.periods, building.design_spectrum.acceleration)


def size(text: str, quantity: Quantity, usual: str) -> float:
    """SI value of a number with a unit; without one it is in the usual unit.

    Raises:
        RecordError: no number, or a unit of something else.
    """
    matched = SIZE.fullmatch(text)
    if matched is None:
        raise RecordError(f"{text!r} is not a number with a unit, such as {_example(quantity)}")
    number, unit = matched.groups()
    try:
        gain = unit_gain(unit or usual)
    except FormatError as error:
        raise RecordError(f"{text!r}: {error}") from None
    if gain.quantity != quantity:
        raise RecordError(f"{text!r} has the unit of {gain.quantity}; give {quantity}, such as {_example(quantity)}")
    return float(number) * gain.si_per_count


def _example(quantity: Quantity) -> str:
    return "400 gal" if quantity == "acceleration" else "300 mm"
