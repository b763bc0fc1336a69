"""How a stream flows, channel by channel: how far it has come, its latency and its gaps."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # it imports ObsPy, which those who read flows do not need
    from service.records.streams.packets import Packet

SLACK = 1.5
"""Samples between two packets beyond which there is a gap: times are rounded, and one sample is the rule."""


@dataclass(frozen=True, slots=True)
class Flow:
    """How one channel flows."""

    reached: datetime
    """Time of its last sample."""
    latency: float
    """s from its last sample to the arrival of the packet; below 0 where the recorder's clock is ahead."""
    gaps: int
    """Number of times that samples were missing between two packets."""
    missing: float
    """s that are still missing."""

    def beyond(self, packet: "Packet", now: datetime) -> "Flow":
        """The flow after a further packet."""
        latency = (now - packet.end).total_seconds()
        interval = timedelta(seconds=1 / packet.rate)
        if packet.start <= self.reached:  # late, or out of order: it may fill a gap
            filled = max(0.0, (min(packet.end, self.reached) - packet.start + interval).total_seconds())
            return replace(self, reached=max(self.reached, packet.end), missing=max(0.0, self.missing - filled))
        lost = packet.start - self.reached - interval
        is_gap = packet.start - self.reached > SLACK * interval
        return Flow(
            reached=packet.end,
            latency=latency,
            gaps=self.gaps + is_gap,
            missing=self.missing + (lost.total_seconds() if is_gap else 0.0),
        )


def flowed(flows: Mapping[str, Flow], packets: Iterable["Packet"], now: datetime) -> dict[str, Flow]:
    """The flows of all channels after further usable packets."""
    after = dict(flows)
    for packet in packets:
        had = after.get(packet.channel)
        first = Flow(packet.end, (now - packet.end).total_seconds(), 0, 0.0)
        after[packet.channel] = first if had is None else had.beyond(packet, now)
    return after


def written(flows: Mapping[str, Flow]) -> dict[str, Any]:
    """As JSON."""
    return {channel: asdict(flow) | {"reached": flow.reached.isoformat()} for channel, flow in flows.items()}


def read(document: Mapping[str, Any]) -> dict[str, Flow]:
    """From JSON."""
    return {
        channel: Flow(datetime.fromisoformat(one["reached"]), one["latency"], one["gaps"], one["missing"])
        for channel, one in document.items()
    }
