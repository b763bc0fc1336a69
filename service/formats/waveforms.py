"""Records in miniSEED, SAC, K-NET and KiK-net files, read by ObsPy."""

import re
import struct
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from io import BytesIO
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from service.formats.format_errors import FormatError, UnknownUnitError
from service.formats.trace import Contents, Trace
from service.formats.units import Gain

if TYPE_CHECKING:  # it takes long to import, and is imported where such a file is read
    import obspy

MINISEED = re.compile(rb"[0-9 \x00]{6}[DRQM][ \x00]")
SAC_VERSION_AT = 304  # byte of NVHDR, which is 6 or 7

OBJECT = re.compile(r"<[\w.]+ object at 0x[0-9a-fA-F]+>")
"""ObsPy's messages have this in place of the file's name."""
FORMS = {"MSEED": "miniSEED", "SAC": "SAC", "KNET": "K-NET or KiK-net ASCII"}

ONE_READER = Lock()
"""Warnings are filtered for the whole process: one reader at a time, and no other thread's warnings become errors."""


def is_miniseed(data: bytes) -> bool:
    """True if these bytes begin as a miniSEED 2 record does."""
    return MINISEED.match(data) is not None


def is_sac(data: bytes) -> bool:
    """True if these bytes have a binary SAC header."""
    version = data[SAC_VERSION_AT : SAC_VERSION_AT + 4]
    return len(version) == 4 and any(struct.unpack(f"{order}i", version)[0] in (6, 7) for order in "<>")


def is_knet(data: bytes) -> bool:
    """True if these bytes begin as K-NET and KiK-net ASCII files do."""
    return data.startswith(b"Origin Time")


def read_miniseed(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The records of a miniSEED file; its units come from elsewhere."""
    stream = _stream(name, data, "MSEED")
    record = min(trace.stats.mseed.record_length for trace in stream)
    if excess := len(data) % record:  # libmseed may leave such a rest out silently
        raise FormatError(_ends_within(name, excess, record))
    return _with_gains(stream, gains)


def read_sac(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The record of a SAC file; its units come from elsewhere, because few writers state them."""
    return _with_gains(_stream(name, data, "SAC"), gains)


def read_knet(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The record of a K-NET or KiK-net ASCII file, whose header states the unit and the length."""
    traces = []
    for trace in _stream(name, data, "KNET"):
        stated, count = round(trace.stats.knet.duration * trace.stats.sampling_rate), trace.stats.npts
        if count != stated:
            raise FormatError(
                f"{name} is truncated or damaged: its header promises {stated} samples, {count} follow; fetch it again"
            )
        trace.data = trace.data.astype(np.int32)  # counts, which ObsPy hands over as floats
        traces.append(_trace(trace, Gain(trace.stats.calib, "acceleration")))
    return Contents("waveforms", tuple(traces))


def _stream(name: str, data: bytes, form: str) -> "obspy.Stream":
    """ObsPy's traces; its warnings are errors here, so that no sample is omitted silently."""
    import obspy

    try:
        with ONE_READER, warnings.catch_warnings():
            warnings.filterwarnings("error", module=r"obspy\.")
            stream = obspy.read(BytesIO(data), format=form)
    except MemoryError:
        raise
    except Exception as error:  # ObsPy's readers raise whatever a broken file makes them stumble over
        record = _record_length(data) if form == "MSEED" else None
        if record and len(data) % record:
            raise FormatError(_ends_within(name, len(data) % record, record)) from error
        said = " ".join(OBJECT.sub("the file", str(error)).split())[:200]
        known = f" ({said})" if said and "Cannot open file" not in said else ""
        raise FormatError(
            f"{name} is truncated or damaged: its {len(data):,} bytes cannot be read as {FORMS[form]}{known}; fetch it "
            f"again"
        ) from error
    if not any(trace.stats.npts for trace in stream):
        raise FormatError(f"{name} is truncated or empty: it holds no samples; fetch it again")
    return stream


def _ends_within(name: str, excess: int, record: int) -> str:
    return f"{name} is truncated: it ends in the middle of a record, {excess:,} of {record:,} bytes; fetch it again"


def _record_length(data: bytes) -> int | None:
    """Bytes of the first record, by its blockette 1000 (SEED manual 2.4, chapter 8); None where it has none."""
    for order in "><":
        at = struct.unpack_from(f"{order}H", data, 46)[0] if len(data) >= 48 else 0
        if (
            48 <= at <= len(data) - 7
            and struct.unpack_from(f"{order}H", data, at)[0] == 1000
            and 7 <= data[at + 6] < 20
        ):
            return int(2 ** data[at + 6])
    return None


def _with_gains(stream: "obspy.Stream", gains: Mapping[str, Gain]) -> Contents:
    unknown = tuple(dict.fromkeys(trace.id for trace in stream if trace.id not in gains))
    traces = tuple(_trace(trace, gains[trace.id]) for trace in stream if trace.id in gains)
    if not traces:
        raise UnknownUnitError(unknown)
    return Contents("waveforms", traces, without_unit=unknown)


def _trace(trace: "obspy.Trace", gain: Gain) -> Trace:
    return Trace(
        channel=trace.id,
        start=trace.stats.starttime.datetime.replace(tzinfo=UTC),
        rate=float(trace.stats.sampling_rate),
        numbers=np.asarray(trace.data),
        gain=gain.si_per_count,
        quantity=gain.quantity,
    )


@dataclass(frozen=True, slots=True)
class Piece:
    """A channel without a gap, from half an interval before its first sample to half of one after its last."""

    channel: str
    start: datetime
    end: datetime
    interval: timedelta
    """Between two samples."""


def covered(data: bytes) -> tuple[Piece, ...]:
    """The pieces in a file of waveforms, whatever their unit.

    Raises:
        FormatError: ObsPy cannot read it.
    """
    import obspy

    pieces = []
    try:
        for trace in obspy.read(BytesIO(data), headonly=True):
            half = trace.stats.delta / 2
            start, end = ((trace.stats.starttime - half).datetime, (trace.stats.endtime + half).datetime)
            interval = timedelta(seconds=trace.stats.delta)
            pieces.append(Piece(trace.id, start.replace(tzinfo=UTC), end.replace(tzinfo=UTC), interval))
    except MemoryError:
        raise
    except Exception as error:  # ObsPy's readers raise whatever a broken file makes them stumble over
        raise FormatError(f"the waveforms cannot be read: {error}") from error
    return tuple(pieces)
