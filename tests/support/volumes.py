"""Volume 2 files written for tests after the published layouts, as no archive of such files is at hand.

Layouts: COSMOS Strong Motion Programs Board (2001), COSMOS Strong Motion Data Format, version 1.20; Shakal & Huang
(1985), Standard Tape Format for CSMIP Strong-Motion Data Tapes, CSMIP report OSMS 85-03.
"""

import re
from collections.abc import Iterable

import numpy as np

KINDS = {
    "acceleration": ("Corrected acceleration", 1, 4, "cm/sec2"),
    "velocity": ("Velocity data", 2, 5, "cm/sec"),
    "displacement": ("Displacement data", 3, 6, "cm"),
}
TEXT = """\
{title:<26}(Format v01.20 with 13 text lines)
Record of Berkeley Earthquake           Thu Jan 04, 2018 02:39 PST
Hypocenter: 37.8552 -122.2568  H= 12km(NCSN) M=4.4
Origin: 01/04/2018, 10:39:37.7 UTC (NCSN)
Statn No: 05- 58658 Code:CE-58658  CGS  Hayward - Tall Building
Coords: 37.6910 -122.0990   Site geology:
Recorder: Granit s/n   133 (18 Chns of  20 at Sta) Sensor:FBA-11  s/n 1889
Rcrd start time:01/04/2018, 10:39:22.250 UTC (Q=5) RcrdId: 58658-G0133-18010.01
Sta Chan {channel:>2}: 340 deg (Rcrdr Chan  1) Location: Roof, north
Raw record length =  70.000 sec, Uncor max =   -.167 g     at   27.850 sec
Processed: 01/05/2018, 12:01:00 UTC      Max =  -161.962         at   27.850 sec
Record filtered below 0.30 Hz (periods over  3.3 secs),  and above 40.0 Hz
Values used when parameter or data value is unknown/unspecified:   -999, -999.0
"""


def wave(count: int, seed: int = 3) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.round(np.random.default_rng(seed).uniform(-90, 90, count), 5)


def table(heading: str, cells: Iterable[str], columns: int) -> str:
    numbers = list(cells)
    rows = ["".join(numbers[row : row + columns]) for row in range(0, len(numbers), columns)]
    return "\n".join([heading, *rows, ""])


def record(kind: str = "acceleration", channel: int = 7, count: int = 20, layout: str = "8F10.5") -> str:
    """One record; 200 Hz though the recorder's interval, real 34, is 0.02 s."""
    title, parameter, code, unit = KINDS[kind]
    samples = wave(count)
    integers = dict.fromkeys(range(1, 101), -999)
    integers |= {1: 2, 2: parameter, 3: code, 4: 120, 8: 58658, 11: 5, 50: channel, 54: 340}
    integers |= {40: 2018, 41: 4, 42: 1, 43: 4, 44: 10, 45: 39}
    reals = dict.fromkeys(range(1, 101), -999.0)
    reals |= {30: 22.25, 34: 0.02, 62: 5.0, 63: count * 0.005, 64: samples[np.argmax(np.abs(samples))], 65: 0.0}
    columns, letter, width, decimals = re.findall(r"[A-Z]|\d+", layout)
    unit_line = f"{count:8d} {kind:12} pts, approx    0 secs, units={unit:>7}({code:02d}),Format=({layout})"
    parts = (
        TEXT.format(title=title, channel=channel),
        table(
            " 100 Integer-header values follow on  10 lines, Format= (10I8)", map("{:8d}".format, integers.values()), 10
        ),
        table(
            " 100 Real-header values follow on  17 lines, Format= (6F13.6)", map("{:13.6f}".format, reals.values()), 6
        ),
        '   2 Comment line(s) follow, each starting with a "|":\n| Sensor: FBA-11\n|<PROCESS> MANUAL\n',
        table(unit_line, (format(value, f"{width}.{decimals}{letter}") for value in samples), int(columns)),
        f"End-of-data for Chan {channel:2d} {kind}\n",
    )
    return "".join(parts)


SERIES = {"accel": "cm/sec2", "veloc": "cm/sec", "displ": "cm"}


def volume(count: int = 20, start: str = "1/04/18, 10:39:22.0 UTC", peak: float | None = None) -> str:
    """A file of one channel, in the layout of CSMIP's own."""
    rng = np.random.default_rng(3)
    samples = {name: np.round(rng.uniform(-9, 9, count), 6) for name in SERIES}
    top = float(np.abs(samples["accel"]).max()) if peak is None else peak
    header = [""] * 25
    header[0] = "Corrected accelerogram   58658-G0133-18010.01       Chan  1:  Up         from"
    header[4] = f"58658-G0133-18010.01                 Start time:  {start} (GPS)"
    header[5] = "Station No. 58658   37.691N, 122.099W    Granit  s/n  133 (18 Chns of 20 at Sta)"
    header[7] = "Chan  7:  Long                      Location: Abutment 1"
    header[17] = f"Peak acceleration = {top:9.3f}    cm/sec/sec  at   25.660   sec."
    lines = [*header, *("    0" * 16 for _ in range(7)), *("  .0000000" * 8 for _ in range(13))]
    for name, unit in SERIES.items():
        lines.append(f" {count} points of {name} data equally spaced at  .005 sec, in {unit}. (8f10.6)")
        cells = [f"{value:10.6f}" for value in samples[name]]
        lines += ["".join(cells[row : row + 8]) for row in range(0, count, 8)]
    return "\n".join([*lines, "/&  ----------  End of data for channel  7  ----------", ""])
