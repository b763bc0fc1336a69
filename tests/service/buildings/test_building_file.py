import math
import re
from pathlib import Path

import pytest
from building_files import FOLDER, SMALL
from hypothesis import given, strategies as st
from pydantic import BaseModel
from shared_data import BNCS, needs_shared

from service.buildings.description import BuildingFileError, read
from service.buildings.description_keys import (
    BuildingTable,
    ChannelTable,
    ContactTable,
    DesignTable,
    IsolationTable,
    LevelTable,
    LimitsTable,
    LimitTable,
    ReceiverTable,
    SourceTable,
)
from service.formats import Gain

DOCUMENTATION = Path(__file__).resolve().parents[3] / "docs" / "operate" / "building.md"


def problems(text: str) -> tuple[str, ...]:
    with pytest.raises(BuildingFileError) as caught:
        read(text, FOLDER)
    return caught.value.problems


def line(text: str, beginning: str) -> int:
    """The number of the first line that begins so."""
    return next(n for n, found in enumerate(text.splitlines(), start=1) if found.startswith(beginning))


def test_reads_every_key() -> None:
    building = read(SMALL, FOLDER)
    description = building.description
    assert (description.code, description.name) == ("TOWER", "a tower")
    assert (building.latitude, building.longitude, building.timezone) == (35.5, 139.6, "Asia/Tokyo")
    assert [level.role for level in description.levels] == ["ground", "base", "floor", "floor"]
    assert description.floor_mass.tolist() == [2.7e6, 2.3e6]
    assert description.floors[0].stiffness == 3.1e9
    assert description.mass_uncertainty.tolist() == [0.05, 0.0, 0.0]
    assert description.isolation.rubber_height == 0.2
    assert (description.isolation.design_displacement, description.isolation.moat_clearance) == (0.4, 0.5)
    assert description.isolation.design.F_y == 655.4e3
    assert [channel.direction for channel in description.channels] == ["x", "x", "x", "x", None]


def test_a_building_file_without_limits_is_read() -> None:
    isolation = read("\n".join(x for x in SMALL.splitlines() if "design_" not in x and "moat" not in x), FOLDER)
    assert (isolation.description.isolation.design_displacement, isolation.description.isolation.moat_clearance) == (
        None,
        None,
    )


def test_a_gain_is_in_si_once_it_is_read() -> None:
    assert read(SMALL, FOLDER).gains == {"XX.TOWER.01.HNX": Gain(-0.0025, "acceleration")}


def test_a_relative_folder_lies_beside_the_file(tmp_path: Path) -> None:
    source = read(SMALL, tmp_path).source
    assert source is not None
    assert source.location == str(tmp_path / "records")


def test_a_servers_address_is_kept_as_written() -> None:
    text = SMALL.replace('"folder"', '"fdsnws"').replace('"records"', '"http://127.0.0.1:8080"')
    source = read(text, FOLDER).source
    assert source is not None
    assert source.location == "http://127.0.0.1:8080"
    assert source.data == "events"


@needs_shared
def test_reads_the_real_building() -> None:
    building = read((BNCS / "building.toml").read_text("utf-8"), BNCS)
    assert building.description.base_mass == 231995.0
    assert [level.name for level in building.description.floors] == ["2", "3", "4", "5", "roof"]
    assert len(building.description.channels) == 8
    assert building.source is not None
    assert Path(building.source.location) == BNCS


# what is written; what is written instead; the line to be named; what the message says
WRONG = {
    "unknown key": (
        "rubber_height = 0.2",
        "ruber_height = 0.2",
        "ruber",
        "isolation.ruber_height: no such key; did you mean 'rubber_height'?",
    ),
    "unknown far key": (
        "rubber_height = 0.2",
        "colour = 1",
        "colour",
        "known here: rubber_height, design_displacement, moat_clearance, damper_stroke, rubber, installed, design",
    ),
    "displacement in mm": (
        "design_displacement = 0.4",
        "design_displacement = 400",
        "design_displacement",
        "isolation.design_displacement: input should be less than or equal to 5, got 400",
    ),
    "no gap": (
        "moat_clearance = 0.5",
        "moat_clearance = 0",
        "moat_clearance",
        "isolation.moat_clearance: input should be greater than 0, got 0",
    ),
    "gap within the design": (
        "moat_clearance = 0.5",
        "moat_clearance = 0.3",
        "moat_clearance",
        "isolation.moat_clearance: 0.3 m is less than design_displacement, 0.4 m; check both",
    ),
    "text for a number": (
        "mass = 2.3e6",
        'mass = "2.3e6"',
        'mass = "2.3e6"',
        "level[4].mass: input should be a valid number, got '2.3e6'",
    ),
    "negative mass": (
        "mass = 2.7e6",
        "mass = -2.7e6",
        "mass = -",
        "level[3].mass: input should be greater than 0, got -2700000.0",
    ),
    "infinite mass": (
        "mass = 2.7e6",
        "mass = inf",
        "mass = inf",
        "level[3].mass: input should be a finite number",
    ),
    "zero design value": (
        "D_y = 1.5e-3",
        "D_y = 0.0",
        "D_y",
        "isolation.design.D_y: input should be greater than 0",
    ),
    "direction": (
        'direction = "x"',
        'direction = "N"',
        'direction = "N"',
        "channel[1].direction: input should be 'x', 'y' or 'z', got 'N'",
    ),
    "quantity": (
        'quantity = "temperature"',
        'quantity = "heat"',
        'quantity = "heat"',
        "channel[5].quantity: input should be",
    ),
    "time zone": (
        "Asia/Tokyo",
        "Asia/Tokio",
        "timezone",
        "timezone: 'Asia/Tokio' is not a time zone",
    ),
    "latitude": (
        "35.5",
        "135.5",
        "latitude",
        "latitude: input should be less than or equal to 90",
    ),
    "code with a blank": (
        '"TOWER"',
        '"A TOWER"',
        "code",
        "code: string should match pattern",
    ),
    "source kind": (
        '"folder"',
        '"ftp"',
        "kind",
        "source.kind: input should be 'folder', 'fdsnws', 'archive' or 'seedlink', got 'ftp'",
    ),
    "two bases": (
        'name = "2F"',
        'name = "2F"\nrole = "base"',
        None,
        "level 3 from the ground up must be 'floor', got 'base'",
    ),
    "channel id": (
        "XX.TOWER.03.HNX",
        "TOWER",
        'id = "TOWER"',
        "channel[3].id: string should match pattern",
    ),
    "same channel twice": (
        "XX.TOWER.03.HNX",
        "XX.TOWER.01.HNX",
        None,
        "channel[3].id: 'XX.TOWER.01.HNX' is already used by channel[2]",
    ),
    "same level twice": (
        'name = "2F"',
        'name = "roof"',
        None,
        "level[4].name: 'roof' is already used by level[3]",
    ),
    "level of a channel": (
        'level = "roof"',
        'level = "RF"',
        'level = "RF"',
        "no level is named 'RF'; the levels are pit, slab, 2F, roof",
    ),
    "unit": (
        'unit = "gal"',
        'unit = "furlong"',
        'unit = "furlong"',
        "channel[2].unit: unit 'furlong' is not known",
    ),
    "absurd unit": (
        'unit = "gal"',
        'unit = "mm"',
        'unit = "mm"',
        "'mm' is a unit of displacement, but this channel measures acceleration",
    ),
    "no gain": (
        "gain = -0.25\n",
        "",
        "unit",
        "give gain too",
    ),
    "gain of zero": (
        "gain = -0.25",
        "gain = 0",
        "gain",
        "channel[2].gain: must not be 0",
    ),
    "direction of a temperature": (
        'level = "slab"\nquantity = "temperature"',
        'level = "slab"\ndirection = "z"\nquantity = "temperature"',
        'direction = "z"',
        "a temperature has none",
    ),
    "stiffness of the base": (
        "mass = 8.0e6",
        "mass = 8.0e6\nstiffness = 1.0",
        "stiffness = 1.0",
        "only a floor has a storey below it",
    ),
    "uncertain mass of the ground": (
        'role = "ground"',
        'role = "ground"\nmass_uncertainty = 0.1',
        "mass_uncertainty = 0.1",
        "the ground has no mass",
    ),
    "uncertainty of a mass in percent": (
        "mass_uncertainty = 0.05",
        "mass_uncertainty = 5",
        "mass_uncertainty = 5",
        "less than 1",
    ),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_key_is_named_with_its_line_and_what_is_wanted(kind: str) -> None:
    right, wrong, named, message = WRONG[kind]
    text = SMALL.replace(right, wrong, 1)
    assert text != SMALL
    (problem,) = [found for found in problems(text) if message in found]
    if named is not None:
        assert problem.startswith(f"line {line(text, named)}: ")


MISSING = {
    "mass": ("mass = 2.3e6\n", "level[4]: mass is missing (kg)"),
    "direction": ('direction = "x"\n', "channel[4]: direction is missing (x, y or z)"),
    "quantity": ('quantity = "temperature"\n', "channel[5].quantity: is missing"),
    "code": ('code = "TOWER"\n', "code: is missing"),
    "source kind": ('kind = "folder"\n', "source.kind: is missing"),
    "base": ('role = "base"\n', "level 2 from the ground up must be 'base', got 'floor'"),
}


@pytest.mark.parametrize("key", MISSING)
def test_a_missing_key_is_named_with_its_table(key: str) -> None:
    left_out, message = MISSING[key]
    text = SMALL.replace(left_out, "")
    assert any(message in found for found in problems(text)), problems(text)


def test_a_radius_needs_a_centre() -> None:
    text = SMALL.replace("latitude = 35.5\n", "").replace('kind = "folder"', 'kind = "fdsnws"\nmaximum_radius = 3.0')
    assert problems(text) == (
        f"line {line(text, 'maximum')}: source.maximum_radius: needs a centre; give latitude and longitude at the top "
        f"of the file",
    )


def test_all_that_is_wrong_is_reported_at_once_in_the_order_of_the_file() -> None:
    text = SMALL.replace("mass = 2.7e6", "mas = 2.7e6").replace('"Asia/Tokyo"', '"Mars"').replace("gal", "m")
    found = problems(text)
    assert [problem.split(":")[0] for problem in found] == [
        f"line {line(text, 'timezone')}",
        f"line {line(text, '[[level]]') + 8}",
        f"line {line(text, 'mas ')}",
        f"line {line(text, 'unit')}",
    ]


def test_limits_replace_the_defaults_with_their_source() -> None:
    given = '[limits]\nshear_strain = { watch = 1.5, act = 2.2, source = "catalogue" }\n'
    [(name, limits)] = read(SMALL + given, FOLDER).limits.items()
    assert (name, limits.watch, limits.inspect, limits.act, limits.source) == (
        "shear_strain",
        1.5,
        None,
        2.2,
        "catalogue",
    )


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ('shear_strain = { watch = 2, inspect = 1, source = "a" }', "1 must be above watch, 2"),
        ('storey_drift = { source = "a" }', "gives no level"),
        ("storey_drift = { watch = 0.002 }", "limits.storey_drift.source: is missing"),
        ('long_period_class = { watch = 5, source = "a" }', "the classes are 1, 2, 3 and 4, got 5"),
        ('storey_drifts = { watch = 1, source = "a" }', "did you mean 'storey_drift'?"),
    ],
)
def test_wrong_limits_are_named(limits: str, message: str) -> None:
    assert any(message in problem for problem in problems(f"{SMALL}[limits]\n{limits}\n"))


def test_bad_syntax_is_named_with_its_line() -> None:
    (problem,) = problems(SMALL.replace("mass = 2.7e6", "mass = "))
    assert "this is not TOML" in problem
    assert f"line {line(SMALL, 'mass = 2.7e6')}" in problem


@given(
    value=st.sampled_from(["1", '"x"', "[]", "[1, 2, 3]", "[[], []]", "{}", "{x = 1}", "[{}, {}, {}]", "true"]),
    key=st.sampled_from(["level", "channel", "isolation", "source", "code", "timezone"]),
)
def test_any_value_in_place_of_a_table_is_a_problem_not_a_crash(key: str, value: str) -> None:
    assert problems(f"{key} = {value}")


@pytest.mark.parametrize(
    "table",
    [
        BuildingTable,
        LevelTable,
        IsolationTable,
        DesignTable,
        LimitsTable,
        LimitTable,
        SourceTable,
        ChannelTable,
        ReceiverTable,
        ContactTable,
    ],
    ids=lambda t: t.__name__,
)
def test_every_key_is_documented(table: type[BaseModel]) -> None:
    text = DOCUMENTATION.read_text("utf-8")
    for key, field in table.model_fields.items():
        assert field.description, key
        rows = [line for line in text.splitlines() if line.startswith(f"| `{key}` |")]
        assert any(field.description in row for row in rows), key


def test_contacts_are_read_in_order_and_must_be_reachable() -> None:
    first = '[[contact]]\nname = "On call"\nrole = "engineer"\nphone = "+81 (3) 0000-0100"\n'
    second = '[[contact]]\nname = "Owner"\nrole = "owner"\nmail = "o@example.org"\n'
    contacts = read(SMALL + first + second, FOLDER).contacts
    assert [one.name for one in contacts] == ["On call", "Owner"]
    assert (contacts[0].dialled, contacts[1].dialled) == ("+81300000100", "")
    silent = '[[contact]]\nname = "X"\nrole = "y"\n'
    (unreachable,) = problems(SMALL + first + silent)
    assert "contact[2]: gives neither phone nor mail" in unreachable
    for wrong in ('phone = "call me"', 'phone = "javascript:1"', 'mail = "no address"', 'name = "a\\nb"'):
        assert problems(SMALL + silent.replace('name = "X"\n', "", wrong.startswith("name")) + wrong), wrong


def test_the_documented_example_is_right() -> None:
    (example,) = re.findall(r"```toml\n(.*?)```", DOCUMENTATION.read_text("utf-8"), re.DOTALL)
    assert read(example, FOLDER).description.code == "TOWER"


PAIR = """
[[channel]]
id = "XX.TOWER.02.HNX"
level = "2F"
direction = "x"
quantity = "acceleration"
position = [4, -3.5]
rotation = 30
[[channel]]
id = "XX.TOWER.02.HNY"
level = "2F"
direction = "y"
quantity = "acceleration"
position = [4, -3.5]
rotation = 30
"""


def test_a_sensors_place_and_its_axes_are_read_in_si() -> None:
    x, y = read(SMALL + PAIR, FOLDER).description.channels[-2:]
    assert x.position == y.position == (4.0, -3.5)
    assert x.rotation == y.rotation == pytest.approx(math.pi / 6)


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("[4, -3.5]", "[4]", "channel[6].position[2]: is missing (m, [x, y] of the sensor"),
        ("[4, -3.5]", '[4, "x"]', "channel[6].position[2]: input should be a valid number, got 'x'"),
        ("[4, -3.5]", "[5, -3.5]", "channel[6].rotation: axes are turned in pairs, but 0 channels in direction y"),
        ("rotation = 30", "rotation = 20", "channel[6].rotation: axes are turned in pairs"),
        ("rotation = 30", "rotation = 300", "channel[6].rotation: input should be less than or equal to 180"),
    ],
)
def test_a_wrong_place_or_angle_is_named(right: str, wrong: str, message: str) -> None:
    found = problems(SMALL + PAIR.replace(right, wrong, 1))
    assert any(message in problem for problem in found), found


SPECTRUM = '[design_spectrum]\nperiods = {periods}\nacceleration = [5.0, 8.0]\nsource = "calculation"\n'


def test_a_design_spectrum_is_read_and_wrong_ones_are_named() -> None:
    known = read(SMALL + SPECTRUM.format(periods="[0.1, 0.5]"), FOLDER).design_spectrum
    assert known is not None
    assert (known.periods, known.acceleration, known.source) == ((0.1, 0.5), (5.0, 8.0), "calculation")
    [longer] = problems(SMALL + SPECTRUM.format(periods="[0.1, 0.5, 1.0]"))
    assert "design_spectrum.acceleration: 2 values for 3 periods" in longer
    [falling] = problems(SMALL + SPECTRUM.format(periods="[0.5, 0.1]"))
    assert "design_spectrum.periods: the periods must rise" in falling
