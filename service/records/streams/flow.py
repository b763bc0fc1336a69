"""Progress of a stream by channel: its last sample, the arrival of its last packet, and its gaps."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

from service.buildings.description import BuildingFile
from service.records.tables import StreamState

if TYPE_CHECKING:  # it imports ObsPy, which those who read flows do not need
    from service.records.streams.packets import Packet

SLACK = 1.5
"""Samples between two packets beyond which there is a gap: times are rounded, and one sample is the rule."""


@dataclass(frozen=True, slots=True)
class Flow:
    """Flow of one channel."""

    reached: datetime
    """Time of its last sample; before the first, of the connection that first requested it."""
    arrived: datetime
    """Time of its last packet's arrival; before the first, of that connection."""
    gaps: int
    """Number of times that samples were missing between two packets."""
    missing: float
    """s that are still missing."""
    has_sent: bool = True
    """False until its first packet comes."""

    def latency(self, now: datetime) -> float:
        """s by which it lies behind; from its last packet's arrival where the recorder's clock is ahead."""
        return max(0.0, (now - min(self.reached, self.arrived)).total_seconds())

    def is_silent(self, now: datetime, silence: timedelta) -> bool:
        """True if no packet of it has come for longer than `silence`."""
        return now - self.arrived > silence

    def beyond(self, packet: "Packet", now: datetime) -> "Flow":
        """The flow after a further packet."""
        if not self.has_sent:
            return Flow(packet.end, now, 0, 0.0)
        interval = timedelta(seconds=1 / packet.rate)
        if packet.start <= self.reached:  # late, or out of order: it may fill a gap
            filled = max(0.0, (min(packet.end, self.reached) - packet.start + interval).total_seconds())
            reached, missing = max(self.reached, packet.end), max(0.0, self.missing - filled)
            return replace(self, reached=reached, arrived=now, missing=missing)
        lost = packet.start - self.reached - interval
        is_gap = packet.start - self.reached > SLACK * interval
        return Flow(
            reached=packet.end,
            arrived=now,
            gaps=self.gaps + is_gap,
            missing=self.missing + (lost.total_seconds() if is_gap else 0.0),
        )


def flowed(flows: Mapping[str, Flow], packets: Iterable["Packet"], now: datetime) -> dict[str, Flow]:
    """The flows of all channels after further usable packets."""
    after = dict(flows)
    for packet in packets:
        after[packet.channel] = after.get(packet.channel, _unsent(now)).beyond(packet, now)
    return after


def of_channels(flows: Mapping[str, Flow], channels: Iterable[str], connected: datetime | None) -> dict[str, Flow]:
    """The flows of these channels, in their order.

    Args:
        flows: as they are known.
        channels: ids.
        connected: since when there is a connection: a channel without a flow counts from then on. Without one it is
            omitted.
    """
    unsent = None if connected is None else _unsent(connected)
    found = {channel: flows.get(channel, unsent) for channel in channels}
    return {channel: one for channel, one in found.items() if one is not None}


def of_stream(state: StreamState, described: BuildingFile) -> dict[str, Flow]:
    """The flows of the channels of the description; none where its source is no longer a stream."""
    if described.source is None or described.source.kind != "seedlink":
        return {}
    channels = [channel.id for channel in described.description.channels]
    return of_channels(read(state.channels), channels, state.connected_since)


def silent(state: StreamState, described: BuildingFile, now: datetime, silence: timedelta) -> dict[str, str] | None:
    """Since when each silent channel of a stream is silent, as JSON; None if none is.

    Time without a connection does not count, unless the channel was silent before it was lost.

    Args:
        state: of the stream.
        described: the building.
        now: aware time.
        silence: time without a packet after which a channel counts as silent.
    """
    before, connected = state.silent or {}, state.connected_since or now
    flows = {channel: one for channel, one in of_stream(state, described).items() if one.is_silent(now, silence)}
    since = {channel: before.get(channel, max(one.arrived, connected).isoformat()) for channel, one in flows.items()}
    return since or None


def written(flows: Mapping[str, Flow]) -> dict[str, Any]:
    """As JSON."""
    return {
        channel: asdict(flow) | {"reached": flow.reached.isoformat(), "arrived": flow.arrived.isoformat()}
        for channel, flow in flows.items()
    }


def read(document: Mapping[str, Any]) -> dict[str, Flow]:
    """From JSON; that of earlier versions has the latency at the last packet's arrival instead of the arrival."""
    return {channel: _read(one) for channel, one in document.items()}


def _read(one: Mapping[str, Any]) -> Flow:
    reached = datetime.fromisoformat(one["reached"])
    is_earlier = "arrived" not in one
    arrived = reached + timedelta(seconds=one["latency"]) if is_earlier else datetime.fromisoformat(one["arrived"])
    return Flow(reached, arrived, one["gaps"], one["missing"], one.get("has_sent", True))


def _unsent(since: datetime) -> Flow:
    return Flow(since, since, 0, 0.0, has_sent=False)
