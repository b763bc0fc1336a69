"""`menshin building draft`: what StationXML says is written, what is missing is marked, a filled draft is valid."""

import re
import tomllib
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

import pytest
from command import menshin
from monitoring_server import Page, monitoring_server
from obspy import UTCDateTime
from obspy.core.inventory import Channel, Inventory, Network, Response, Site, Station
from obspy.core.inventory.response import InstrumentSensitivity
from shared_data import BNCS, needs_shared

from service.buildings.description import BuildingFile, BuildingFileError, read_new
from service.buildings.station_metadata import StationError, stations

MARK = re.compile(r"^#(\w+) =   # FILL IN: .*$", re.MULTILINE)
VALUES = {"mass": "1.0e6", "quantity": '"acceleration"', "direction": '"x"'}
NOW = datetime(2024, 1, 1, tzinfo=UTC)


def channel(location: str, code: str, depth: float = 0.0, unit: str | None = "M/S**2", **other: object) -> Channel:
    response = unit and Response(instrument_sensitivity=InstrumentSensitivity(1e5, 1.0, unit, "COUNTS"))
    return Channel(code, location, 35.5, 139.6, 20.0, depth, response=response or None, **other)


def metadata(*channels: Channel, others: tuple[Station, ...] = ()) -> bytes:
    tower = Station("TWR", 35.5, 139.6, 20.0, channels=list(channels), site=Site('the "tower" 塔'))
    file = BytesIO()
    Inventory([Network("XX", [tower, *others])], source="a test").write(file, format="STATIONXML")
    return file.getvalue()


THREE_LEVELS = (
    *(channel("00", code, 5.0) for code in ("HNE", "HNN")),
    channel("00", "HNZ", 5.2, azimuth=0.0, dip=-90.0),
    *(channel("01", code, 2.0) for code in ("HNE", "HNN")),
    *(channel("02", code, -30.0) for code in ("HNE", "HNN")),
)


def filled(draft: str) -> BuildingFile:
    """The building of a draft whose marks are filled in."""
    return read_new(MARK.sub(lambda mark: f"{mark[1]} = {VALUES[mark[1]]}", draft), Path("/"))


def drafted(folder: Path, data: bytes, *options: str) -> str:
    (folder / "station.xml").write_bytes(data)
    done = menshin("building", "draft", folder / "station.xml", *options)
    assert done.exit_code == 0, done.output
    return done.stdout


def test_levels_and_directions_come_from_the_metadata(tmp_path: Path) -> None:
    text = drafted(tmp_path, metadata(*THREE_LEVELS))
    with pytest.raises(BuildingFileError) as error:
        read_new(text, tmp_path)
    assert [one for one in str(error.value).splitlines() if "mass is missing (kg)" not in one] == []
    building = filled(text)
    assert (building.description.code, building.description.name) == ("TWR", 'the "tower" 塔')
    assert (building.latitude, building.longitude) == (35.5, 139.6)
    assert building.source is None
    assert [level.name for level in building.description.levels] == ["ground", "base slab", "floor 1"]
    made = {one.id: (one.level, one.direction, one.quantity) for one in building.description.channels}
    assert made == {
        "XX.TWR.00.HNE": ("ground", "x", "acceleration"),
        "XX.TWR.00.HNN": ("ground", "y", "acceleration"),
        "XX.TWR.00.HNZ": ("ground", "z", "acceleration"),
        "XX.TWR.01.HNE": ("base slab", "x", "acceleration"),
        "XX.TWR.01.HNN": ("base slab", "y", "acceleration"),
        "XX.TWR.02.HNE": ("floor 1", "x", "acceleration"),
        "XX.TWR.02.HNN": ("floor 1", "y", "acceleration"),
    }
    optional = re.findall(r"^#(\w+) =   # optional", text, re.MULTILINE)
    assert {"rubber_height", "design_displacement", "moat_clearance", "height", "timezone"} <= set(optional)


def test_what_the_metadata_lack_is_marked(tmp_path: Path) -> None:
    bare = (
        channel("00", "HNR", unit=None),  # neither direction nor sensitivity
        channel("01", "XYX", unit=None),  # no quantity
        channel("02", "LKO", unit="degC"),
        channel("02", "BDF", unit="PA"),  # a barometer
        channel("02", "HNE", end_date=UTCDateTime(2020, 1, 1)),  # ended
    )
    text = drafted(tmp_path, metadata(*bare), "--code", "HQ")
    assert sorted(MARK.findall(text)) == ["direction", "mass", "mass", "quantity"]
    assert "# left out: XX.TWR.02.BDF: unit 'PA' is not known" in text
    building = filled(text)
    assert building.description.code == "HQ"
    assert {one.id: one.quantity for one in building.description.channels} == {
        "XX.TWR.00.HNR": "acceleration",
        "XX.TWR.01.XYX": "acceleration",
        "XX.TWR.02.LKO": "temperature",
    }
    assert text.count("#gain =") == 2


def test_a_draft_from_a_server_names_it_as_the_source() -> None:
    with monitoring_server() as server:
        server.pages["/fdsnws/station/1/query"] = Page(metadata(*THREE_LEVELS))
        address = server.address.replace("http://", "http://me:s3cret@")
        done = menshin("building", "draft", address, "--station", "XX.TWR", "--network", "XX")
        [(path, headers)] = server.requested
        none = menshin("building", "draft", server.address)
        server.pages["/fdsnws/station/1/query"] = Page(status=204)
        absent = menshin("building", "draft", server.address, "--station", "NO")
    assert (done.exit_code, none.exit_code, absent.exit_code) == (0, 1, 1), done.output
    assert path == "/fdsnws/station/1/query?network=XX&station=TWR&level=channel"
    assert headers["Authorization"].startswith("Basic ")
    assert "s3cret" not in done.output
    source = tomllib.loads(done.stdout)["source"]
    assert source == {"kind": "fdsnws", "location": server.address, "data": "continuous"}
    assert filled(done.stdout).source is not None
    assert "--station" in none.stderr
    assert "has no station NO" in absent.stderr


def test_stations_are_chosen_by_name_and_nothing_is_guessed(tmp_path: Path) -> None:
    other = Station("SEA", 30.0, 130.0, 0.0, channels=[channel("00", "HNE")])
    both = metadata(*THREE_LEVELS, others=(other,))
    with pytest.raises(StationError, match=r"has 2 stations \(XX.TWR, XX.SEA\); name those"):
        stations("a.xml", both, (), NOW)
    assert stations("a.xml", both, ["SEA"], NOW).latitude == 30.0
    assert len(stations("a.xml", both, ["XX.SEA", "TWR"], NOW).channels) == 8
    with pytest.raises(StationError, match=r"has no station NONE; it has XX\.TWR, XX\.SEA"):
        stations("a.xml", both, ["NONE"], NOW)
    with pytest.raises(StationError, match="no channel that a building file can use"):
        stations("a.xml", metadata(), (), NOW)


@needs_shared
def test_the_real_building(tmp_path: Path) -> None:
    text = drafted(tmp_path, (BNCS / "station.xml").read_bytes(), "-o", str(tmp_path / "draft.toml"))
    assert text == ""
    found = filled((tmp_path / "draft.toml").read_text("utf-8")).description
    real = read_new((BNCS / "building.toml").read_text("utf-8"), BNCS).description
    assert {one.id: one.quantity for one in found.channels} == {one.id: one.quantity for one in real.channels}
