"""A file is read in another process, within its limits; one that is too much costs the service only the attempt."""

import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from time import sleep
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import psutil
import pytest
from record_files import CHANNEL, KNET, logger_counts, record_file, stationxml

from service import formats, parsing
from service.formats import Contents, FormatError, Gain, UnknownFormatError, UnknownUnitError
from service.parsing import Limits, ParserDiedError

GAINS = {CHANNEL: Gain(1e-5, "acceleration")}
LIMITS = Limits(30.0, 2**30)
HEADING = b"# start: 2024-01-01T00:00:00.25+09:00\n# rate: 100\nXX.TOWER.01.HNX [gal]\n"
LONG = HEADING + b"0.5\n" * 4_000_000
"""It takes more than half a second, and more than 64 MiB."""
FILES = {
    "miniSEED": record_file("MSEED", logger_counts(500), logger_counts(300)),
    "floats": record_file("MSEED", logger_counts(500).astype(np.float32)),
    "K-NET": KNET.read_bytes(),
    "CSV": HEADING + b"0.1\n-1e-300\n",
    "StationXML": stationxml(("01", 4.0, "M/S**2"), ("02", 3.0, "furlong")),
}


def living() -> list[psutil.Process]:
    children = psutil.Process().children()
    return [
        one for one in children if one.status() != psutil.STATUS_ZOMBIE and "service.parsing.child" in one.cmdline()
    ]


def comparable(contents: Contents) -> object:
    traces = [
        (t.channel, t.start, t.rate, t.numbers.dtype, t.numbers.tobytes(), t.gain, t.quantity, t.sensor)
        for t in contents.traces
    ]
    return contents.kind, traces, contents.gains, contents.without_unit, contents.remarks


@pytest.mark.parametrize("kind", FILES)
def test_what_is_read_there_is_what_is_read_here(kind: str) -> None:
    there = parsing.read("a", FILES[kind], GAINS, LIMITS)
    assert comparable(there) == comparable(formats.read("a", FILES[kind], GAINS))
    assert all(trace.start.utcoffset() is not None for trace in there.traces)


def test_refusals_are_the_same_too() -> None:
    with pytest.raises(UnknownUnitError) as unit:
        parsing.read("a", FILES["miniSEED"], {}, LIMITS)
    assert unit.value.channels == (CHANNEL,)
    with pytest.raises(UnknownFormatError, match="begins with b'note'"):
        parsing.read("a", b"note", {}, LIMITS)
    with pytest.raises(FormatError, match="is truncated"):
        parsing.read("a", record_file("MSEED", logger_counts(5000))[:-50], GAINS, LIMITS)


def test_the_parser_stays_warm() -> None:
    parsing.read("a", FILES["CSV"], {}, LIMITS)
    before = living()
    parsing.read("a", FILES["CSV"], {}, LIMITS)
    assert living() == before != []


def test_a_file_that_takes_too_long_is_given_up_and_the_next_is_read() -> None:
    with pytest.raises(
        ParserDiedError, match=r"^a takes more than 0\.1 s to be read; a smaller file, or a larger parser\.time_limit"
    ):
        parsing.read("a", LONG, {}, Limits(0.1, 2**30))
    assert len(parsing.read("a", FILES["CSV"], {}, LIMITS).traces) == 1


def test_a_file_that_takes_too_much_memory_is_given_up() -> None:
    with pytest.raises(ParserDiedError, match="a needs more than 64 MiB of memory to be read"):
        parsing.read("a", LONG, {}, Limits(30.0, 2**26))


def test_a_small_archive_costs_little() -> None:
    """0.1 MiB that unpacks to as much as any archive may."""
    buffer = BytesIO()
    with ZipFile(buffer, "w", ZIP_DEFLATED) as made:
        made.writestr("a.csv", HEADING + b"0\n" * (15 * 2**20))
    with pytest.raises(FormatError, match="lines, at most 5000000 are accepted"):
        parsing.read("a.zip", buffer.getvalue(), {}, LIMITS)
    (parser,) = [one for one in living() if str(LIMITS.memory) in one.cmdline()]
    status = Path(f"/proc/{parser.pid}/status").read_text("ascii")
    (peak,) = [int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")]
    assert peak < 700 * 1024  # KiB, of which ObsPy has some 100 MiB
    assert sum(parser.cpu_times()[:2]) < 20  # s, with the import of ObsPy and the other tests' files


def test_a_parser_sees_no_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MENSHIN_DATABASE_URL", "postgresql://me:secret@h/n")
    limits = Limits(29.0, 2**30)
    parsing.read("a", FILES["CSV"], {}, limits)
    for parser in living():
        assert "MENSHIN_DATABASE_URL" not in parser.environ()


@pytest.mark.parametrize("times", [1, 2])
def test_a_parser_that_is_stopped_while_the_service_lives_gets_the_file_once_more(times: int) -> None:
    """By the signal that says that the service ended, which a busy machine may send late, of our own last write."""
    parsing.read("a", FILES["CSV"], {}, LIMITS)
    stopped: list[psutil.Process] = []
    used: dict[psutil.Process, float] = {}
    with ThreadPoolExecutor(1) as pool:
        reading = pool.submit(parsing.read, "a", LONG, {}, LIMITS)
        while len(stopped) < times and not reading.done():
            for parser in living():
                now = sum(parser.cpu_times()[:2])
                if parser not in stopped and now > used.setdefault(parser, now) + 0.3:
                    parser.send_signal(signal.SIGIO)
                    stopped.append(parser)
            sleep(0.01)
        assert len(stopped) == times
        if times == 1:
            assert comparable(reading.result()) == comparable(formats.read("a", LONG, {}))
        else:
            with pytest.raises(ParserDiedError, match="SIGIO"):
                reading.result()
    parsing.read("a", FILES["CSV"], {}, LIMITS)


PARENT = """
import sys
from service import parsing
from service.parsing import Limits
parsing.read("a", b"# start: 2024-01-01T00:00:00Z\\n# rate: 100\\nA [gal]\\n1\\n", {}, Limits(600.0, 2**31))
print("warm", flush=True)
if sys.argv[1] == "busy":
    data = b"# start: 2024-01-01T00:00:00Z\\n# rate: 100\\n" + b",".join([b"A [gal]"] * 20) + b"\\n"
    data += (b"0.5," * 19 + b"0.5\\n") * 1_000_000
    while True:
        parsing.read("a", data, {}, Limits(600.0, 2**31))
sys.stdin.read()
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
@pytest.mark.parametrize("state", ["busy", "idle"])
def test_a_parser_ends_with_the_service(state: str, number: signal.Signals) -> None:
    command = [sys.executable, "-c", PARENT, state]
    with psutil.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as parent:
        try:
            assert parent.stdout.readline() == b"warm\n"
            (parser,) = parent.children()
            used = sum(parser.cpu_times()[:2])
            while state == "busy" and sum(parser.cpu_times()[:2]) < used + 0.3:
                sleep(0.01)
            parent.send_signal(number)
            parent.wait()
            parser.wait(timeout=3)  # reading the file takes longer
        finally:
            if parent.poll() is None:
                parent.kill()
