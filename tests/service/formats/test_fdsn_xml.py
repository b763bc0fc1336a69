import pytest
from record_files import stationxml
from shared_data import BNCS, needs_shared

from service.formats import FormatError, Gain, read


@pytest.mark.parametrize(
    ("sensitivity", "unit", "gain"),
    [
        (1.0, "M/S**2", Gain(1.0, "acceleration")),
        (213909.0, "M/S**2", Gain(1 / 213909, "acceleration")),
        (50.0, "cm/s**2", Gain(0.01 / 50, "acceleration")),
        (2.0, "M/S", Gain(0.5, "velocity")),
        (-4.0, "M", Gain(-0.25, "displacement")),  # a sensor mounted reversed
        (10.0, "degC", Gain(0.1, "temperature")),
    ],
)
def test_a_gain_is_the_units_size_over_the_sensitivity(sensitivity: float, unit: str, gain: Gain) -> None:
    contents = read("station.xml", stationxml(("01", sensitivity, unit)), {})
    assert contents.kind == "station"
    assert contents.gains == {"XX.TOWER.01.HNX": gain}


def test_a_channel_of_another_unit_is_omitted_with_a_note() -> None:
    contents = read("station.xml", stationxml(("01", 1.0, "M/S**2"), ("02", 1.0, "V"), ("03", 1.0, None)), {})
    assert list(contents.gains) == ["XX.TOWER.01.HNX"]
    unit, response = contents.remarks
    assert unit.startswith("XX.TOWER.02.HNX: unit 'V' is not known")
    assert response.startswith("XX.TOWER.03.HNX: no instrument sensitivity")


def test_a_file_without_any_usable_unit_is_refused() -> None:
    with pytest.raises(FormatError, match=r"gives no channel a usable unit: XX.TOWER.02.HNX: unit 'V' is not known"):
        read("station.xml", stationxml(("02", 1.0, "V")), {})


def test_epochs_that_disagree_are_not_guessed_from() -> None:
    epochs = stationxml(("01", 1.0, "M/S**2"), ("01", 2.0, "M/S**2"), ("02", 1.0, "M/S**2"))
    contents = read("station.xml", epochs, {})
    assert list(contents.gains) == ["XX.TOWER.02.HNX"]
    assert "epochs of different sensitivity" in contents.remarks[0]


def test_epochs_that_agree_are_one() -> None:
    epochs = stationxml(("01", 2.0, "M/S**2"), ("01", 2.0, "M/S**2"))
    assert read("station.xml", epochs, {}).gains == {"XX.TOWER.01.HNX": Gain(0.5, "acceleration")}


def test_broken_xml_is_refused() -> None:
    with pytest.raises(FormatError, match="is not readable StationXML"):
        read("station.xml", stationxml(("01", 1.0, "M"))[:700], {})


@needs_shared
def test_the_real_buildings_gains() -> None:
    gains = read("station.xml", (BNCS / "station.xml").read_bytes(), {}).gains
    assert len(gains) == 8
    assert gains["XX.BNCS.06.HNX"] == Gain(1.0, "acceleration")
    assert gains["XX.BNCS.01.HYX"] == Gain(1.0, "displacement")
