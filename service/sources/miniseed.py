"""Whether an answer of waveforms is whole, and which times of which channels it holds."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from io import BytesIO

import obspy

from service.formats import FormatError, UnknownUnitError, read


@dataclass(frozen=True, slots=True)
class Piece:
    """A channel without a gap, from half an interval before its first sample to half of one after its last."""

    channel: str
    start: datetime
    end: datetime
    interval: timedelta
    """Between two samples."""


def problem(name: str, body: bytes) -> str | None:
    """Why these are no whole waveforms; None if they are. Their units are not asked for here."""
    try:
        read(name, body, {})
    except UnknownUnitError:
        return None
    except FormatError as error:
        return str(error)
    return None


def pieces(bodies: Iterable[bytes]) -> tuple[Piece, ...]:
    """What there is in whole waveforms."""
    found = []
    for body in bodies:
        for trace in obspy.read(BytesIO(body), headonly=True):
            half = trace.stats.delta / 2
            start, end = ((trace.stats.starttime - half).datetime, (trace.stats.endtime + half).datetime)
            interval = timedelta(seconds=trace.stats.delta)
            found.append(Piece(trace.id, start.replace(tzinfo=UTC), end.replace(tzinfo=UTC), interval))
    return tuple(found)
