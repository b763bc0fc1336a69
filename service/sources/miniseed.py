"""Whether an answer of waveforms is whole, and how far it reaches, which tells where to ask next."""

from datetime import UTC, datetime
from io import BytesIO

import obspy

from service.formats import FormatError, UnknownUnitError, read


def problem(name: str, body: bytes) -> str | None:
    """Why these are no whole waveforms; None if they are. Their units are not asked for here."""
    try:
        read(name, body, {})
    except UnknownUnitError:
        return None
    except FormatError as error:
        return str(error)
    return None


def complete_until(body: bytes | None, channels: int, start: datetime, late: datetime) -> datetime:
    """The time up to which nothing more is to be expected.

    Args:
        body: miniSEED, or None for silence.
        channels: how many are expected.
        start: from which was asked.
        late: before this time whatever is missing will not come any more.
    """
    ends: dict[str, datetime] = {}
    try:
        stream = obspy.read(BytesIO(body), headonly=True) if body else ()
    except Exception:  # no waveforms: what it is, the reading of the recording will tell
        return max(start, late)
    for trace in stream:
        end = (trace.stats.endtime + trace.stats.delta / 2).datetime.replace(tzinfo=UTC)
        ends[trace.id] = max(end, ends.get(trace.id, end))
    complete = min(ends.values()) if len(ends) >= channels else late
    return max(start, complete, late)
