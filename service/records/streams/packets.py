"""Packets of a stream, examined before they are used: their headers, and whether their samples can be read."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256

from pymseed import MS3Record, sourceid2nslc

from core.record import Channel
from service import parsing
from service.formats import FormatError, Gain, UnknownUnitError
from service.formats.trace import RATES, Trace, of_building
from service.parsing import Limits, ParserDiedError, ParserFailedError
from service.records.ingest import CLOCK_SET, CLOCK_SLACK
from service.records.streams.seedlink import Received

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
NAME = "a packet"
"""Name of a packet in a reader's messages."""


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet, with what its header says."""

    station: str
    sequence: int | None
    channel: str
    start: datetime
    """Time of its first sample."""
    end: datetime
    """Time of its last sample."""
    rate: float
    """Hz; 0 where the header cannot be read."""
    data: bytes = field(repr=False)
    reason: str | None = None
    """Why it cannot be used."""

    @property
    def digest(self) -> str:
        """SHA-256 of the bytes."""
        return sha256(self.data).hexdigest()


def examined(
    came: Iterable[Received],
    channels: Sequence[Channel],
    gains: Mapping[str, Gain],
    limits: Limits,
    now: datetime,
) -> list[Packet]:
    """The packets with their headers, and why one cannot be used.

    Samples are read in the parser's process. Packets of a channel without a unit are good: StationXML may follow.
    """
    packets = [_checked(_headed(one, now), channels, now) for one in came]
    good = [packet for packet in packets if packet.reason is None]
    if good and not _is_readable(good, channels, gains, limits):
        bad = {id(packet): reason for packet in good if (reason := _unreadable(packet, channels, gains, limits))}
        return [replace(one, reason=bad[id(one)]) if id(one) in bad else one for one in packets]
    return packets


def traces(data: bytes, channels: Sequence[Channel], gains: Mapping[str, Gain], limits: Limits) -> tuple[Trace, ...]:
    """The building's traces in the bytes of packets.

    Raises:
        FormatError, ParserDiedError, ParserFailedError: they cannot be read.
    """
    return of_building(parsing.read(NAME, data, gains, limits).traces, channels)


def _headed(one: Received, now: datetime) -> Packet:
    unread = Packet(one.station, one.sequence, "", now, now, 0.0, one.data)
    try:
        record = MS3Record.parse(one.data)
        channel = ".".join(sourceid2nslc(record.sourceid))
        start, count, rate = record.starttime, record.samplecnt, float(record.samprate)
        read = replace(unread, channel=channel, start=_moment(start), end=_moment(record.endtime), rate=rate)
    except Exception as error:  # whatever hostile bytes make the reader stumble over
        return replace(unread, reason=f"it is not miniSEED ({type(error).__name__}: {error})")
    if record.formatversion != 2:
        return replace(read, reason="it is miniSEED 3; have the server send miniSEED 2")
    if record.reclen != len(one.data):
        return replace(read, reason=f"its {len(one.data)} bytes are not one record, which has {record.reclen}")
    if count < 1:
        return replace(read, reason="it has no samples")
    return read


def _moment(nanoseconds: int) -> datetime:
    return EPOCH + timedelta(microseconds=round(nanoseconds / 1000))


def _checked(packet: Packet, channels: Sequence[Channel], now: datetime) -> Packet:
    """The packet, with the reason where its header is impossible or no channel's of the building."""
    return packet if packet.reason is not None else replace(packet, reason=_fault(packet, channels, now))


def _fault(packet: Packet, channels: Sequence[Channel], now: datetime) -> str | None:
    quantity = next((one.quantity for one in channels if one.id == packet.channel), None)
    if quantity is None:
        return f"{packet.channel} is not a channel of this building"
    lowest, highest = RATES[quantity]
    if not lowest <= packet.rate <= highest:
        return f"{packet.channel} has {packet.rate:g} samples a second; {lowest:g} to {highest:g} Hz are accepted"
    if packet.start < CLOCK_SET or packet.end > now + CLOCK_SLACK:
        return f"{packet.channel} was recorded at {packet.start:%Y-%m-%d %H:%M:%S} UTC by its clock; set the clock"
    return None


def _is_readable(
    packets: Sequence[Packet], channels: Sequence[Channel], gains: Mapping[str, Gain], limits: Limits
) -> bool:
    return _problem(lambda: traces(b"".join(one.data for one in packets), channels, gains, limits)) is None


def _unreadable(packet: Packet, channels: Sequence[Channel], gains: Mapping[str, Gain], limits: Limits) -> str | None:
    return _problem(lambda: traces(packet.data, channels, gains, limits))


def _problem(read: Callable[[], object]) -> str | None:
    try:
        read()
    except UnknownUnitError:
        return None
    except (FormatError, ParserDiedError, ParserFailedError) as error:
        return str(error)
    return None
