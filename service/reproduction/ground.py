"""Which ground motion shakes the paper's building?"""

from dataclasses import dataclass
from pathlib import Path

from core.arrays import Vector
from core.paper import ground_motion
from service import akt013
from service.formats import FormatError, Gain, Trace, UnknownUnitError, read


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A recorded motion, made ready to stand in for the paper's."""

    name: str
    acceleration: Vector
    """(n,) m/s² at core.paper.RATE."""


def default() -> Ground:
    """AKT013, which comes with ObsPy."""
    return Ground(akt013.NAME, ground_motion(*akt013.recorded()))


def of_file(path: Path, channel: str | None) -> Ground:
    """The motion that a file holds; its unit does not matter, since its peak becomes the paper's.

    Args:
        path: any format that records may have.
        channel: which of its channels; None where it holds one only.

    Raises:
        FormatError: a file that cannot be read, or that leaves open which channel is meant.
        RecordError: a motion that is too long, or none.
        OSError: a file that cannot be opened.
    """
    trace = _chosen(path.name, _accelerations(path.name, path.read_bytes()), channel)
    return Ground(f"{path.name}, {trace.channel}", ground_motion(trace.to_si(), trace.rate))


def _accelerations(name: str, data: bytes) -> tuple[Trace, ...]:
    """What a file holds; numbers of unknown unit are taken for accelerations."""
    try:
        traces = read(name, data, {}).traces
    except UnknownUnitError as error:
        traces = read(name, data, dict.fromkeys(error.channels, Gain(1.0, "acceleration"))).traces
    return tuple(trace for trace in traces if trace.quantity == "acceleration")


def _chosen(name: str, traces: tuple[Trace, ...], channel: str | None) -> Trace:
    found = [trace for trace in traces if channel in (None, trace.channel)]
    if len(found) == 1:
        return found[0]
    names = ", ".join(sorted({trace.channel for trace in traces})) or "no acceleration"
    wanted = "one unbroken channel" if channel is None else f"{channel} in one piece"
    raise FormatError(f"{name} holds {names}; {wanted} is needed, name it with --channel")
