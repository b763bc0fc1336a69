"""Which times of which channels waveforms hold, whatever their unit."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from io import BytesIO

import obspy

from service.formats.errors import FormatError


@dataclass(frozen=True, slots=True)
class Piece:
    """A channel without a gap, from half an interval before its first sample to half of one after its last."""

    channel: str
    start: datetime
    end: datetime
    interval: timedelta
    """Between two samples."""


def covered(data: bytes) -> tuple[Piece, ...]:
    """What there is in a file of whole waveforms.

    Raises:
        FormatError: ObsPy cannot read it.
    """
    found = []
    try:
        for trace in obspy.read(BytesIO(data), headonly=True):
            half = trace.stats.delta / 2
            start, end = ((trace.stats.starttime - half).datetime, (trace.stats.endtime + half).datetime)
            interval = timedelta(seconds=trace.stats.delta)
            found.append(Piece(trace.id, start.replace(tzinfo=UTC), end.replace(tzinfo=UTC), interval))
    except MemoryError:
        raise
    except Exception as error:  # ObsPy's readers raise whatever a broken file makes them stumble over
        raise FormatError(f"the waveforms cannot be read: {error}") from error
    return tuple(found)
