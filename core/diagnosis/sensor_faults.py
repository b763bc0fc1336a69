"""Faults of sensors, judged by several earthquakes together.

A finding of the screening counts where it recurs in half of the earthquakes or more: what fails once was mended or
left out there. A reversal or an exchange, which weak records do not show, counts in fewer. Gains and clocks are judged
by all records at once (core.sensors.sensor_errors). A transducer's drift that is likely in half of the earthquakes is
certain if the sum of its squared certainties is.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

import numpy as np

from core.analysis import EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription
from core.record import Channel, Finding, Quantity, Record
from core.rounding import with_std
from core.sensors.resting_level import LIKELY_CHANGE, BaselineDrift, baseline_drift, transducer_drift
from core.sensors.sensor_errors import SensorError, sensor_errors


class Cause(Enum):
    """Part of the building or its instruments in which a fault lies."""

    SENSOR = "sensor_fault"
    SUPERSTRUCTURE = "superstructure"
    MASS = "mass"


@dataclass(frozen=True, slots=True)
class BuildingFault:
    """One property that is not as described, judged by all records together."""

    cause: Cause
    kind: str
    """Kind of fault, one stable word for programs: `gain`, `delay`, `polarity`, `storey`, `mass`, `floor_share`, ..."""
    channel: str | None
    """Id of the sensor's channel, or name of the floor above the storey; None for the masses."""
    value: float
    """Size in SI units; see the message."""
    std: float | None
    """Standard deviation of the value; None if it has none, as for a polarity."""
    message: str
    """For an engineer: the fault with its number and unit, and its remedy."""
    late: float = 0.0
    """s, of a clock that runs at another rate: its delay in the middle of the records."""
    is_corrected: bool = False
    """True if the records, or the forces, were corrected for it in a copy before the isolation layer was judged."""


KINDS: Mapping[str, str] = MappingProxyType(
    {
        "reversed": "polarity",
        "swapped": "swap",
        "rotation": "rotation",
        "unit": "gain",
        "offset": "drift",
        "clipping": "clipping",
        "spike": "spikes",
        "gap": "dropped",
        "dead": "dead",
        "incoherent": "incoherent",
        "neighbour": "neighbour",
        "clock": "clock_jump",
    }
)
"""Part at fault for each finding of the screening; a note is no fault."""
IN_USE = frozenset({"gain", "delay", "clock", "clock_jump", "drift"})
"""Faults with which a channel stays in use; an analysis corrects or excludes channels with other faults."""
AGAIN = 0.5
"""Share of the earthquakes in which a fault comes again if it is the sensor's. A choice."""
WIRING = frozenset({"polarity", "swap"})
"""Faults that are there in every earthquake and show only in those that are strong at low frequencies."""
SELDOM, TWICE = 0.25, 2
"""The same share for these, and the smallest number of earthquakes. A choice, with seed 503 of polarity@RF in view."""
SMALLEST = {"gain": 0.03, "delay": 2e-3, "clock": 5e-5}
"""1, s and s/s: smaller errors do not change the conclusions."""
CERTAIN = 4.0
"""Standard deviations that a gain, a delay or a change of level must be of. A choice."""
SMALLEST_CREEP: Mapping[Quantity, float] = MappingProxyType({"displacement": 0.004, "acceleration": 0.03})
"""Smallest change of level, as a share of the largest value: the filter removes most of an acceleration's drift."""


def sensor_faults(analyses: Sequence[EventAnalysis], description: BuildingDescription) -> tuple[BuildingFault, ...]:
    """Sensors that err, with what is wrong: a channel may err in several ways.

    Args:
        analyses: of several earthquakes, also of those that were refused.
        description: of the building.
    """
    faults = [*_screened(analyses), *_drifting_channels(analyses, description)]
    for direction in description.horizontal_directions:
        differences = [one for analysis in analyses for one in analysis.differences.get(direction, ())]
        faults += [found for error in sensor_errors(differences) if (found := _erring(error)) is not None]
    return tuple({(fault.channel, fault.kind): fault for fault in faults}.values())


def _screened(analyses: Sequence[EventAnalysis]) -> list[BuildingFault]:
    by_fault: dict[tuple[str, str], dict[int, Finding]] = defaultdict(dict)
    absent: dict[str, int] = defaultdict(int)
    for number, analysis in enumerate(analyses):
        for finding in analysis.quality:
            if finding.channel is None:
                continue
            absent[finding.channel] += finding.kind == "missing"
            if finding.kind in KINDS and finding.severity != "note":
                by_fault[finding.channel, KINDS[finding.kind]][number] = finding
    return [
        _again(channel, kind, list(findings.values()), recorded)
        for (channel, kind), findings in by_fault.items()
        if len(findings) >= _enough(kind, recorded := len(analyses) - absent[channel])
    ]


def _enough(kind: str, recorded: int) -> float:
    """Smallest number of earthquakes with a finding that make it a fault, of those that recorded the channel."""
    usual = AGAIN * recorded
    return min(usual, max(SELDOM * recorded, TWICE)) if kind in WIRING else usual


def _again(channel: str, kind: str, findings: Sequence[Finding], recorded: int) -> BuildingFault:
    worst = max(findings, key=lambda finding: abs(finding.value or 0.0))
    value = float(np.median([finding.value or 0.0 for finding in findings]))
    message = f"in {len(findings)} of {recorded} earthquakes, as in this one: {worst.message}"
    return BuildingFault(Cause.SENSOR, kind, channel, value, None, message)


def _erring(error: SensorError) -> BuildingFault | None:
    """The error in words, if it is certain and large enough to matter."""
    at, size = {"gain": (0, float(np.expm1(error.value[0])))}.get(error.part, (-1, float(error.value[-1])))
    std = float(np.sqrt(error.covariance[at, at])) * (1 + size if error.part == "gain" else 1.0)
    if abs(size) < max(SMALLEST[error.part], CERTAIN * std):
        return None
    message = _said(error.part, size, std)
    if error.others:
        message = "; ".join((message, f"an opposite error of {' or '.join(error.others)} would have the same effect"))
    late = float(error.value[0]) if error.part == "clock" else 0.0
    return BuildingFault(Cause.SENSOR, error.part, error.channel, size, std, message, late)


def _said(part: str, size: float, std: float) -> str:
    if part == "gain":
        share = with_std(100 * abs(size), 100 * std)
        amount = f"{share} % too much" if size > 0 else f"{share} % too little"
        return f"reads {amount} against the other sensors; check it, or divide its gain by {1 + size:.3f}"
    if part == "delay":
        delay = with_std(1000 * abs(size), 1000 * std)
        amount = f"{delay} ms late" if size > 0 else f"{delay} ms early"
        return f"is {amount} against the other sensors, with no change; check filters and time stamps of its logger"
    rate = with_std(1000 * abs(size), 1000 * std)
    amount = f"{rate} ms per second slow" if size > 0 else f"{rate} ms per second fast"
    return f"its clock is {amount} against the others'; synchronise its logger with a common time source"


def _drifting_channels(analyses: Sequence[EventAnalysis], description: BuildingDescription) -> list[BuildingFault]:
    """Sensors whose level changes at rest."""
    known: dict[Channel, list[BaselineDrift]] = defaultdict(list)
    for analysis in analyses:
        if analysis.record is None:
            continue
        for channel, samples in zip(analysis.record.channels, analysis.record.samples, strict=True):
            if not _rests(channel, description):
                continue
            if channel.quantity == "displacement":
                relative = _across(analysis.record, description, channel)
                drift = transducer_drift(samples, analysis.rate, relative)
            else:
                drift = baseline_drift(samples, analysis.rate)
            if drift is not None:
                known[channel].append(drift)
    return [fault for channel, all_ in known.items() if (fault := _drift_fault(channel, all_)) is not None]


def _across(record: Record, description: BuildingDescription, channel: Channel) -> Vector | None:
    """(n,) m/s², acceleration of the base slab less the ground's in a channel's direction; None without either."""
    if channel.direction is None:
        return None
    above, below = (
        record.find(level.name, "acceleration", channel.direction) for level in (description.base, description.ground)
    )
    return None if above is None or below is None else above - below


def _rests(channel: Channel, description: BuildingDescription) -> bool:
    """True if its level at rest is constant: a floor may well be displaced against the ground, by its own drift."""
    if channel.quantity == "displacement":
        return channel.level == description.base.name and channel.direction != "z"
    return channel.quantity == "acceleration"


def _drift_fault(channel: Channel, known: Sequence[BaselineDrift]) -> BuildingFault | None:
    large = [one for one in known if one.share > SMALLEST_CREEP[channel.quantity]]
    certain = [one for one in large if one.certainty > CERTAIN]
    if channel.quantity == "displacement" and len(certain) < AGAIN * len(known):
        likely = [one for one in large if one.certainty > LIKELY_CHANGE]
        certain = likely if np.linalg.norm([one.certainty for one in likely]) > CERTAIN else []
    if not certain or len(certain) < AGAIN * len(known):
        return None
    worst = max(certain, key=lambda one: one.certainty)
    unit, scale = ("mm", 1000) if channel.quantity == "displacement" else ("gal", 100)
    fault = (
        f"its level changes by {with_std(scale * worst.change, scale * worst.std)} {unit} while the building is at "
        f"rest, in {len(certain)} of {len(known)} earthquakes: it drifts"
    )
    message = ". ".join((fault, "Check its supply, cable and fixing"))
    return BuildingFault(Cause.SENSOR, "drift", channel.id, worst.change, worst.std, message)
