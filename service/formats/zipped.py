"""Zip archives of files of records, with a bound on what they may unpack to."""

from collections.abc import Callable, Mapping
from io import BytesIO
from zipfile import BadZipFile, ZipFile, ZipInfo
from zlib import error as ZlibError  # noqa: N812  a class, whatever its name

from service.formats.errors import FormatError, UnknownFormatError
from service.formats.trace import Contents
from service.formats.units import Gain

LARGEST = 256 * 2**20
"""Bytes, of all members together."""
MOST_MEMBERS = 10_000

Reader = Callable[[str, bytes, Mapping[str, Gain]], Contents]


def is_zip(data: bytes) -> bool:
    """Whether these bytes begin as a zip archive does."""
    return data.startswith((b"PK\x03\x04", b"PK\x05\x06"))


def read_zip(name: str, data: bytes, gains: Mapping[str, Gain], read: Reader) -> Contents:
    """What the members hold together, as `read` reads each; StationXML among them serves the others.

    A member of no known format is left out with a remark, as archives carry spectra and notes beside their records.
    """
    members = _members(name, data)
    stations = {member: content for member, content in members.items() if b"<FDSNStationXML" in content[:4096]}
    told = [read(f"{name}/{member}", content, gains) for member, content in stations.items()]
    known = {**{channel: gain for contents in told for channel, gain in contents.gains.items()}, **gains}
    remarks: list[str] = []
    for member, content in members.items():
        if member in stations:
            continue
        try:
            told.append(read(f"{name}/{member}", content, known))
        except UnknownFormatError as error:
            remarks.append(str(error))
    if not told:
        raise FormatError(f"{name} holds no file of a known format; {'; '.join(remarks[:3]) or 'it is empty'}")
    return _together(told, tuple(remarks))


def _together(told: list[Contents], remarks: tuple[str, ...]) -> Contents:
    traces = tuple(trace for contents in told for trace in contents.traces)
    return Contents(
        kind="waveforms" if traces else "station",
        traces=traces,
        gains={channel: gain for contents in told for channel, gain in contents.gains.items()},
        without_unit=tuple(channel for contents in told for channel in contents.without_unit),
        remarks=tuple(remark for contents in told for remark in contents.remarks) + remarks,
    )


def _members(name: str, data: bytes) -> dict[str, bytes]:
    """The unpacked files by name."""
    try:
        with ZipFile(BytesIO(data)) as archive:
            infos = [info for info in archive.infolist() if not info.is_dir()]
            if len(infos) > MOST_MEMBERS:
                raise FormatError(f"{name} has {len(infos)} members; at most {MOST_MEMBERS} would do")
            left, members = LARGEST, {}
            for info in infos:
                members[info.filename] = _unpacked(name, archive, info, left)
                left -= len(members[info.filename])
            return members
    except (BadZipFile, ZlibError, NotImplementedError, RuntimeError, EOFError, OSError) as error:
        raise FormatError(f"{name} is no readable zip archive: {error}; fetch it again") from error


def _unpacked(name: str, archive: ZipFile, info: ZipInfo, left: int) -> bytes:
    """A member's bytes; the directory's sizes are only claims, so reading stops at the bound."""
    with archive.open(info) as member:
        content = member.read(left + 1)
    if len(content) > left:
        raise FormatError(f"{name} unpacks to more than {LARGEST} bytes; smaller archives would do")
    return content
