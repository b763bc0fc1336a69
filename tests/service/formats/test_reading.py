import subprocess
import sys
from io import BytesIO
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from hypothesis import given, strategies as st
from record_files import CHANNEL, KNET, logger_counts, record_file, stationxml

from service.formats import FormatError, Gain, UnknownFormatError, read, reading

GAINS = {CHANNEL: Gain(1e-5, "acceleration")}


def archive(members: dict[str, bytes]) -> bytes:
    buffer = BytesIO()
    with ZipFile(buffer, "w", ZIP_DEFLATED) as made:
        for name, content in members.items():
            made.writestr(name, content)
    return buffer.getvalue()


def test_the_bytes_show_the_format_whatever_the_name() -> None:
    assert read("record.csv", KNET.read_bytes(), {}).traces[0].channel == "BO.AKT013..EW"


@pytest.mark.parametrize("page", [b"<!DOCTYPE html>\n<html>", b"  <HTML>"])
def test_a_page_is_no_data(page: bytes) -> None:
    body = page + b"<head><title>502 Bad Gateway</title></head></html>"
    with pytest.raises(FormatError, match=r"a.mseed is an HTML page \(502 Bad Gateway\), not data"):
        read("a.mseed", body, GAINS)


def test_nothing_is_no_data() -> None:
    with pytest.raises(FormatError, match=r"a\.mseed is empty"):
        read("a.mseed", b"", GAINS)


@pytest.mark.parametrize("table", ["[[level]]", "[isolation.design]", "[effects.elastic]"])
def test_a_description_is_not_taken_for_a_record(table: str) -> None:
    with pytest.raises(FormatError, match=r"^tower\.toml is a building or model file \(TOML\), not a record"):
        read("tower.toml", f'# a tower\ncode = "TOWER"\n\n{table}\nname = "ground"\n'.encode())


def test_an_unknown_format_is_refused_with_those_that_are_known() -> None:
    formats = "miniSEED, StationXML, K-NET or KiK-net ASCII, CSMIP V2, COSMOS V2, CSV, SAC"
    with pytest.raises(UnknownFormatError, match=formats):
        read("notes.txt", b"The logger was replaced in May.", {})


@given(st.binary(max_size=2000))
def test_whatever_the_bytes_nothing_but_a_refusal_comes_of_noise(noise: bytes) -> None:
    with pytest.raises(FormatError):
        read("noise", noise, GAINS)


@given(
    st.binary(max_size=600),
    st.sampled_from(
        ["000001D ", "Origin Time ", "Corrected accelerogram", "Velocity data (Format v01.20", "#", "<FDSNStationXML"]
    ),
)
def test_whatever_follows_a_right_beginning_nothing_but_a_refusal_comes_of_noise(noise: bytes, beginning: str) -> None:
    with pytest.raises(FormatError):
        read("noise", beginning.encode() + noise, GAINS)


def test_an_archive_is_what_its_members_are() -> None:
    data = archive(
        {"a.mseed": record_file("MSEED", logger_counts(50)), "b.knet": KNET.read_bytes(), "notes.txt": b"a note"}
    )
    contents = read("event.zip", data, GAINS)
    assert [trace.channel for trace in contents.traces] == [CHANNEL, "BO.AKT013..EW"]
    assert contents.remarks[0].startswith("event.zip/notes.txt has an unknown format (it begins with b'a note')")


def test_stationxml_in_an_archive_serves_its_records() -> None:
    data = archive(
        {"a.mseed": record_file("MSEED", logger_counts(50)), "station.xml": stationxml(("01", 4.0, "M/S**2"))}
    )
    (trace,) = read("event.zip", data, {}).traces
    assert trace.gain == 0.25


def test_gains_distinguished_from_outside_go_before_an_archives_own() -> None:
    data = archive(
        {"a.mseed": record_file("MSEED", logger_counts(50)), "station.xml": stationxml(("01", 4.0, "M/S**2"))}
    )
    (trace,) = read("event.zip", data, GAINS).traces
    assert trace.gain == 1e-5


def test_a_broken_member_is_named() -> None:
    data = archive(
        {
            "good.mseed": record_file("MSEED", logger_counts(50)),
            "bad.mseed": record_file("MSEED", logger_counts(5000))[:-50],
        }
    )
    with pytest.raises(FormatError, match=r"event\.zip/bad.mseed is truncated"):
        read("event.zip", data, GAINS)


def test_an_archive_of_strangers_is_refused() -> None:
    with pytest.raises(FormatError, match="holds no file of a known format"):
        read("event.zip", archive({"notes.txt": b"a note"}), {})


def test_an_archive_in_an_archive_is_not_opened() -> None:
    inner = archive({"a.knet": KNET.read_bytes()})
    with pytest.raises(FormatError, match="holds no file of a known format"):
        read("event.zip", archive({"inner.zip": inner}), {})


def test_a_truncated_archive_is_refused() -> None:
    data = archive({"a.knet": KNET.read_bytes()})
    with pytest.raises(FormatError, match="is not a readable zip archive"):
        read("event.zip", data[: len(data) // 2], {})


def test_a_damaged_member_is_refused() -> None:
    data = bytearray(archive({"a.knet": KNET.read_bytes()}))
    data[200:220] = bytes(20)
    with pytest.raises(FormatError, match="is not a readable zip archive"):
        read("event.zip", bytes(data), {})


def test_a_zip_bomb_is_not_unpacked() -> None:
    """A kilobyte for each megabyte: what is unpacked in memory never exceeds the bound by more than a byte."""
    member = bytes(reading.LARGEST // 8)
    data = archive({f"{n}.bin": member for n in range(9)})
    assert len(data) < reading.LARGEST / 500
    with pytest.raises(FormatError, match="unpacks to more than"):
        read("bomb.zip", data, {})


def test_too_many_members_are_not_unpacked() -> None:
    data = archive({f"{n}.txt": b"" for n in range(reading.MOST_MEMBERS + 1)})
    with pytest.raises(FormatError, match="members; at most"):
        read("bomb.zip", data, {})


def test_numbers_stay_as_they_were() -> None:
    assert read("a", record_file("MSEED", np.array([1, 2, 3], dtype=np.int32)), GAINS).traces[0].numbers.tolist() == [
        1,
        2,
        3,
    ]


def test_a_member_without_a_name_is_refused() -> None:
    data = archive({"a": KNET.read_bytes()})
    central, end = data.rindex(b"PK\x01\x02"), data.rindex(b"PK\x05\x06")
    size = int.from_bytes(data[end + 12 : end + 16], "little") - 1
    directory = data[central : central + 28] + b"\0\0" + data[central + 30 : central + 46] + data[central + 47 : end]
    nameless = data[:central] + directory + data[end : end + 12] + size.to_bytes(4, "little") + data[end + 16 :]
    with pytest.raises(FormatError, match="is not a readable zip archive"):
        read("event.zip", nameless, {})


def test_the_example_runs_without_a_database_or_settings() -> None:
    code = (
        "import doctest, sys; from service.formats import reading; failed, tried = doctest.testmod(reading); "
        "assert tried and not failed; assert not {'sqlalchemy', 'service.settings'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
