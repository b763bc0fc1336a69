"""StationXML and QuakeML: the gains of channels, and the origin times of earthquakes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO
from typing import TYPE_CHECKING

from service.formats.format_errors import FormatError
from service.formats.trace import Contents
from service.formats.units import Gain, unit_gain

if TYPE_CHECKING:  # it takes long to import, and is imported where such a file is read
    import obspy
    from obspy.core.inventory import Channel


def is_stationxml(data: bytes) -> bool:
    """True if these bytes begin as StationXML does."""
    return b"<FDSNStationXML" in data[:4096]


def read_stationxml(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The gain of every channel whose unit is known.

    Only the overall sensitivity is applied: structural sensors are flat from 0 Hz to far above the modes.
    """
    import obspy

    try:
        inventory = obspy.read_inventory(BytesIO(data), format="STATIONXML")
    except MemoryError:
        raise
    except Exception as error:  # ObsPy raises whatever the XML makes it stumble over
        raise FormatError(f"{name} is not readable StationXML: {error}; fetch it again") from error
    known: dict[str, Gain] = {}
    remarks: dict[str, str] = {}
    for channel_id, channel in _channels(inventory):
        try:
            gain = channel_gain(channel)
        except FormatError as error:
            remarks[channel_id] = f"{channel_id}: {error}"
            continue
        if known.setdefault(channel_id, gain) != gain:
            remarks[channel_id] = (
                f"{channel_id}: epochs of different sensitivity; use a file with the epoch of these records alone, or "
                f"give gain and unit in the building file"
            )
    kept = {channel_id: gain for channel_id, gain in known.items() if channel_id not in remarks}
    if not kept:
        raise FormatError(f"{name} gives no channel a usable unit: {'; '.join(remarks.values()) or 'it has none'}")
    return Contents("station", gains=kept, remarks=tuple(remarks.values()))


def _channels(inventory: "obspy.Inventory") -> Iterator[tuple[str, "Channel"]]:
    for network in inventory:
        for station in network:
            for channel in station:
                yield f"{network.code}.{station.code}.{channel.location_code}.{channel.code}", channel


def channel_gain(channel: "Channel") -> Gain:
    """The gain of a channel.

    Raises:
        FormatError: it has no sensitivity, or an unknown unit.
    """
    sensitivity = channel.response.instrument_sensitivity if channel.response is not None else None
    if sensitivity is None or not sensitivity.value:
        raise FormatError("no instrument sensitivity; give InstrumentSensitivity with Value and InputUnits")
    unit = unit_gain(sensitivity.input_units or "")
    return Gain(unit.si_per_count / sensitivity.value, unit.quantity)


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin time of an earthquake."""

    id: str
    time: datetime


def origins(data: bytes) -> tuple[Origin, ...]:
    """The earthquakes in a QuakeML catalogue, earliest first.

    Raises:
        FormatError: ObsPy cannot read it.
    """
    import obspy

    try:
        catalog = obspy.read_events(BytesIO(data), format="QUAKEML")
        origins = [Origin(str(event.resource_id), _origin_time(event)) for event in catalog if event.origins]
    except MemoryError:
        raise
    except Exception as error:  # ObsPy raises whatever the XML makes it stumble over
        raise FormatError(f"no readable QuakeML: {error}") from error
    return tuple(sorted(origins, key=lambda origin: origin.time))


def _origin_time(earthquake: "obspy.core.event.Event") -> datetime:
    origin = earthquake.preferred_origin() or earthquake.origins[0]
    time: datetime = origin.time.datetime
    return time.replace(tzinfo=UTC)
