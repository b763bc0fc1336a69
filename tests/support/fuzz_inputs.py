"""Valid files of every format, and ways to spoil them."""

from collections.abc import Callable, Mapping
from io import BytesIO
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import paper_records
from hypothesis import strategies as st
from record_files import CHANNEL, KNET, logger_counts, record_file, stationxml
from volumes import record, volume

from service.formats import Gain

GAINS = {CHANNEL: Gain(1e-5, "acceleration")}
TABLE = b"# start: 2024-01-01T00:00:00Z\n# rate: 100\nXX.TOWER.01.HNX [gal], XX.TOWER.02.KO [degC]\n1.5, 20\n-2, 21\n"


def _archive() -> bytes:
    buffer = BytesIO()
    with ZipFile(buffer, "w", ZIP_DEFLATED) as made:
        made.writestr("a.mseed", record_file("MSEED", logger_counts(50)))
        made.writestr("station.xml", stationxml(("01", 4.0, "M/S**2")))
        made.writestr("b.csv", TABLE)
    return buffer.getvalue()


FILES: Mapping[str, bytes] = {
    "miniSEED": record_file("MSEED", logger_counts(200), logger_counts(100)),
    "miniSEED of floats": record_file("MSEED", logger_counts(200).astype(np.float32)),
    "StationXML": stationxml(("01", 4.0, "M/S**2"), ("02", 3.0, "furlong")),
    "K-NET": KNET.read_bytes()[:3000],
    "SAC": record_file("SAC", logger_counts(200).astype(np.float32)),
    "CSMIP": volume().encode(),
    "COSMOS": record().encode(),
    "CSV": TABLE,
    "zip": _archive(),
}
BUILDING = paper_records.building_file().encode()

ODD = st.sampled_from(
    [
        *(b"", b"\0", b"-", b"nan", b"inf", b"1e999", b"-1", b"0", b"99999999999999999999", b"1e-320", b"\xff\xfe"),
        *(b" " * 300, b"\n" * 5, b"\r", b",", b"[", b"]", b"(", b'"', b"<", b"&x;", b"1:1:1", b"\x7f\xff\xff\xff"),
    ]
)
Edit = Callable[[bytes], bytes]


@st.composite
def edits(draw: st.DrawFn, size: int) -> Edit:
    """One change: a stretch is removed, doubled, moved or replaced."""
    at = draw(st.integers(0, size))
    length = draw(st.sampled_from([0, 1, 1, 2, 4, 8, 40, 512]))
    into = draw(st.integers(0, size))
    instead = draw(st.one_of(ODD, st.binary(min_size=1, max_size=8)))
    kind = draw(st.sampled_from(["replace", "replace", "replace", "leave out", "double", "move", "end"]))

    def edited(data: bytes) -> bytes:
        before, piece, after = data[:at], data[at : at + length], data[at + length :]
        if kind == "replace":
            return before + instead + after
        if kind == "leave out":
            return before + after
        if kind == "double":
            return before + 2 * piece + after
        if kind == "move":
            rest = before + after
            return rest[:into] + piece + rest[into:]
        return before

    return edited


@st.composite
def spoilt(draw: st.DrawFn, data: bytes) -> bytes:
    """A valid file after a few changes."""
    for edit in draw(st.lists(edits(len(data)), min_size=1, max_size=5)):
        data = edit(data)
    return data
