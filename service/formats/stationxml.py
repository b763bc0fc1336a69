"""What StationXML says of channels: the gain at flat response, and of which quantity."""

from collections.abc import Iterator, Mapping
from io import BytesIO

import obspy
from obspy.core.inventory import Channel

from service.formats.errors import FormatError
from service.formats.trace import Contents
from service.formats.units import Gain, unit_gain


def is_stationxml(data: bytes) -> bool:
    """Whether these bytes begin as StationXML does."""
    return b"<FDSNStationXML" in data[:4096]


def read_stationxml(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The gains of every channel whose unit is one of ours.

    Only the overall sensitivity is applied: structural sensors are flat from 0 Hz to far above the modes.
    """
    try:
        inventory = obspy.read_inventory(BytesIO(data), format="STATIONXML")
    except MemoryError:
        raise
    except Exception as error:  # ObsPy raises whatever the XML makes it stumble over
        raise FormatError(f"{name} is no readable StationXML: {error}; fetch it again") from error
    found: dict[str, Gain] = {}
    remarks: dict[str, str] = {}
    for channel_id, channel in _channels(inventory):
        try:
            gain = _gain(channel)
        except FormatError as error:
            remarks[channel_id] = f"{channel_id}: {error}"
            continue
        if found.setdefault(channel_id, gain) != gain:
            remarks[channel_id] = (
                f"{channel_id}: epochs of different sensitivity; a file with the epoch of these records alone, or gain "
                f"and unit in the building file, would do"
            )
    kept = {channel_id: gain for channel_id, gain in found.items() if channel_id not in remarks}
    if not kept:
        raise FormatError(f"{name} gives no channel a usable unit: {'; '.join(remarks.values()) or 'it has none'}")
    return Contents("station", gains=kept, remarks=tuple(remarks.values()))


def _channels(inventory: obspy.Inventory) -> Iterator[tuple[str, Channel]]:
    for network in inventory:
        for station in network:
            for channel in station:
                yield f"{network.code}.{station.code}.{channel.location_code}.{channel.code}", channel


def _gain(channel: Channel) -> Gain:
    sensitivity = channel.response.instrument_sensitivity if channel.response is not None else None
    if sensitivity is None or not sensitivity.value:
        raise FormatError("no instrument sensitivity; InstrumentSensitivity with Value and InputUnits would do")
    unit = unit_gain(sensitivity.input_units or "")
    return Gain(unit.si_per_count / sensitivity.value, unit.quantity)
