"""Zip archives of files of records, with a bound on what they may unpack to."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from zipfile import ZipFile

from service.formats.errors import FormatError, UnknownFormatError
from service.formats.fdsn_xml import is_stationxml
from service.formats.trace import Contents
from service.formats.units import Gain

LARGEST = 256 * 2**20
"""Bytes, of all members together."""
MOST_MEMBERS = 10_000
"""Most files in an archive. Not tuned: a bound on hostile archives."""
LARGEST_RATIO = 100
"""Bytes of all members to one of the archive, beyond SMALL: records compress 3 to 10 times."""
SMALL = 32 * 2**20
"""Bytes, of all members together, that any archive may unpack to."""

Reader = Callable[[str, bytes, Mapping[str, Gain]], Contents]


def is_zip(data: bytes) -> bool:
    """True if these bytes begin as a zip archive does."""
    return data.startswith((b"PK\x03\x04", b"PK\x05\x06"))


def read_zip(name: str, data: bytes, gains: Mapping[str, Gain], read: Reader) -> Contents:
    """The joint contents of the members, each read by `read`; StationXML among them serves the others.

    A member of no known format is left out with a remark, as archives carry spectra and notes beside their records.
    """
    found = [
        read(f"{name}/{member}", content, gains) for member, content in _members(name, data) if is_stationxml(content)
    ]
    known = {**{channel: gain for contents in found for channel, gain in contents.gains.items()}, **gains}
    remarks: list[str] = []
    for member, content in _members(name, data):
        if is_stationxml(content):
            continue
        try:
            found.append(read(f"{name}/{member}", content, known))
        except UnknownFormatError as error:
            remarks.append(str(error))
    if not found:
        raise FormatError(f"{name} holds no file of a known format; {'; '.join(remarks[:3]) or 'it is empty'}")
    return _together(found, tuple(remarks))


def _together(found: list[Contents], remarks: tuple[str, ...]) -> Contents:
    traces = tuple(trace for contents in found for trace in contents.traces)
    return Contents(
        kind="waveforms" if traces else "station",
        traces=traces,
        gains={channel: gain for contents in found for channel, gain in contents.gains.items()},
        without_unit=tuple(channel for contents in found for channel in contents.without_unit),
        remarks=tuple(remark for contents in found for remark in contents.remarks) + remarks,
    )


def _members(name: str, data: bytes) -> Iterator[tuple[str, bytes]]:
    """The files by name, unpacked one at a time; of several with one name the last."""
    bound = min(LARGEST, max(SMALL, LARGEST_RATIO * len(data)))
    with _readable(name):
        archive = ZipFile(BytesIO(data))
        infos = [info for info in archive.infolist() if not info.is_dir()]
    if len(infos) > MOST_MEMBERS:
        raise FormatError(f"{name} has {len(infos)} members; at most {MOST_MEMBERS} are accepted")
    left = bound
    for member, info in {info.filename: info for info in infos}.items():
        with _readable(name), archive.open(info) as opened:
            content = opened.read(left + 1)  # the directory's sizes are only claims
        if len(content) > left:
            raise FormatError(
                f"{name} has {len(data)} bytes and unpacks to more than {bound}; use smaller archives, or ones packed "
                f"at most {LARGEST_RATIO} times"
            )
        left -= len(content)
        yield member, content


@contextmanager
def _readable(name: str) -> Iterator[None]:
    """Turn any error of the zip reader into a FormatError."""
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:  # it raises whatever a broken archive makes it stumble over
        raise FormatError(f"{name} is no readable zip archive: {error}; fetch it again") from error
