"""Stations and channels of a building by its StationXML."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO
from typing import TYPE_CHECKING

from core.record import Quantity
from service.formats.fdsn_xml import channel_gain
from service.formats.format_errors import FormatError
from service.formats.units import Gain

if TYPE_CHECKING:  # it takes long to import, and is imported where such a file is read
    import obspy
    from obspy.core.inventory import Channel


class StationError(Exception):
    """StationXML that gives no draft of a building; the message says what helps."""


@dataclass(frozen=True, slots=True)
class StationChannel:
    """Metadata of a channel."""

    id: str
    """network.station.location.channel"""
    height: float
    """m above the sea: the elevation less the depth."""
    azimuth: float | None
    """degrees from north."""
    dip: float | None
    """degrees, positive downwards."""
    gain: Gain | None
    """None without a sensitivity."""
    quantity: Quantity | None
    """By the unit, else by the code; None where neither says."""

    @property
    def place(self) -> str:
        """Station and location, such as `TWR.01`."""
        return ".".join(self.id.split(".")[1:3]).rstrip(".")


@dataclass(frozen=True, slots=True)
class Stations:
    """Stations in one building."""

    names: tuple[str, ...]
    """network.station"""
    site: str
    """Name of the first station's site."""
    latitude: float
    """degrees, of the first station."""
    longitude: float
    """degrees, of the first station."""
    channels: tuple[StationChannel, ...]
    remarks: tuple[str, ...]
    """Channels that no building file can use, with the reason."""


INSTRUMENTS: Mapping[str, Quantity] = {"N": "acceleration", "H": "velocity", "L": "velocity", "K": "temperature"}
"""Quantity by the second letter of a channel's code (SEED manual 2.4, appendix A)."""


def stations(name: str, data: bytes, wanted: Collection[str], now: datetime) -> Stations:
    """The stations of a building with the channels that record now, or with all where none does.

    Args:
        name: of the file, for messages.
        data: StationXML.
        wanted: codes of stations; empty: the only one.
        now: aware time.

    Raises:
        StationError: it cannot be read, several stations are there and none is wanted, or a wanted one or every channel
            is missing.
    """
    inventory = _inventory(name, data)
    found = {f"{network.code}.{station.code}": station for network in inventory for station in network}
    chosen = {key: one for key, one in found.items() if not wanted or {key, one.code} & set(wanted)}
    shown = ", ".join([*found][:20]) + (" ..." if len(found) > 20 else "")
    if not chosen:
        raise StationError(f"{name} has no station {' or '.join(sorted(wanted))}; it has {shown or 'none at all'}")
    if len(chosen) > 1 and not wanted:
        raise StationError(f"{name} has {len(chosen)} stations ({shown}); name those in the building with --station")
    pairs = [(f"{key}.{c.location_code}.{c.code}", c) for key, one in chosen.items() for c in one]
    recording = [(key, c) for key, c in pairs if c.end_date is None or c.end_date.datetime.replace(tzinfo=UTC) > now]
    channels, remarks = dict[str, StationChannel](), dict[str, str]()
    for key, channel in sorted(recording or pairs, key=lambda pair: pair[0]):
        try:
            channels[key] = _described(key, channel)
        except FormatError as error:
            remarks[key] = f"{key}: {error}"
    if not channels:
        raise StationError(
            f"{name} has no channel that a building file can use; fetch it with level=channel or response"
        )
    first = next(iter(chosen.values()))
    return Stations(
        tuple(chosen),
        (first.site.name if first.site else "") or "",
        float(first.latitude),
        float(first.longitude),
        tuple(channels.values()),
        tuple(remarks.values()),
    )


def _described(key: str, channel: "Channel") -> StationChannel:
    """Metadata of a channel.

    Raises:
        FormatError: its unit is that of nothing that a building has.
    """
    sensitivity = channel.response.instrument_sensitivity if channel.response is not None else None
    gain = None if sensitivity is None or not sensitivity.value else channel_gain(channel)
    quantity = INSTRUMENTS.get(channel.code[1:2]) if gain is None else gain.quantity
    elevation, depth = float(channel.elevation or 0.0), float(channel.depth or 0.0)
    azimuth, dip = (None if one is None else float(one) for one in (channel.azimuth, channel.dip))
    return StationChannel(key, elevation - depth, azimuth, dip, gain, quantity)


def _inventory(name: str, data: bytes) -> "obspy.Inventory":
    import obspy

    try:
        return obspy.read_inventory(BytesIO(data), format="STATIONXML")
    except MemoryError:
        raise
    except Exception as error:  # ObsPy raises whatever the XML makes it stumble over
        raise StationError(f"{name} is not readable StationXML: {error}") from error
