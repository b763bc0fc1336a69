"""Which earthquakes a catalogue in QuakeML names, and when they began."""

from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO

import obspy

from service.formats.errors import FormatError


@dataclass(frozen=True, slots=True)
class Origin:
    """An earthquake's beginning."""

    id: str
    time: datetime


def origins(data: bytes) -> tuple[Origin, ...]:
    """The earthquakes, earliest first.

    Raises:
        FormatError: ObsPy cannot read it.
    """
    try:
        found = obspy.read_events(BytesIO(data), format="QUAKEML")
        beginnings = [Origin(str(event.resource_id), _time(event)) for event in found if event.origins]
    except MemoryError:
        raise
    except Exception as error:  # ObsPy raises whatever the XML makes it stumble over
        raise FormatError(f"no readable QuakeML: {error}") from error
    return tuple(sorted(beginnings, key=lambda origin: origin.time))


def _time(earthquake: obspy.core.event.Event) -> datetime:
    origin = earthquake.preferred_origin() or earthquake.origins[0]
    time: datetime = origin.time.datetime
    return time.replace(tzinfo=UTC)
