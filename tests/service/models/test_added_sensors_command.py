"""`menshin building sensors` by the front door."""

import json
from pathlib import Path

import pytest
from command import menshin

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("own_settings")]


def test_levels_without_a_sensor_are_listed(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "sensors.json"
    done = menshin("building", "sensors", folder / "building.toml", folder / "event1.mseed", "--json", out)
    assert done.exit_code == 0, done.output
    document = json.loads(out.read_text("utf-8"))
    assert document["building"] in done.output
    ratios = [one["force_ratio"] for one in document["sensors"]]
    assert ratios == sorted(ratios)
    assert 0 < ratios[0] < ratios[-1] <= 1
    for one in document["sensors"]:
        assert one["level"] in done.output
    assert document["today"][0]["records"] == 1


def test_records_of_nothing_are_refused(folder: Path, tmp_path: Path) -> None:
    empty = tmp_path / "nothing.mseed"
    empty.write_bytes(b"no record")
    done = menshin("building", "sensors", folder / "building.toml", empty)
    assert done.exit_code == 1
