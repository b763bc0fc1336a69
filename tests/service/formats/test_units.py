import pytest

from service.formats import FormatError, Gain
from service.formats.units import UNITS, unit_gain

SPELLED = {
    "M/S**2": (1.0, "acceleration"),
    "M/S/S": (1.0, "acceleration"),
    "m/s^2": (1.0, "acceleration"),
    "m/s2": (1.0, "acceleration"),
    "m s-2": (1.0, "acceleration"),
    "m/s²": (1.0, "acceleration"),
    "CM/SEC2": (0.01, "acceleration"),
    "cm/sec/sec": (0.01, "acceleration"),
    "CM/S**2": (0.01, "acceleration"),
    "nm/s**2": (1e-9, "acceleration"),
    "Gal": (0.01, "acceleration"),
    "g": (9.80665, "acceleration"),
    "M/S": (1.0, "velocity"),
    "cm/sec": (0.01, "velocity"),
    "M": (1.0, "displacement"),
    "cm": (0.01, "displacement"),
    "µm": (1e-6, "displacement"),
    "degC": (1.0, "temperature"),
    "CELSIUS": (1.0, "temperature"),
}


@pytest.mark.parametrize("unit", SPELLED)
def test_a_unit_is_known_however_it_is_spelled(unit: str) -> None:
    size, quantity = SPELLED[unit]
    gain = unit_gain(unit)
    assert (gain.si_per_count, gain.quantity) == (pytest.approx(size, rel=1e-15), quantity)


@pytest.mark.parametrize("unit", ["", "  ", "V", "counts", "K", "m/s**3", "ft"])
def test_any_other_unit_is_refused_with_a_list_of_valid_ones(unit: str) -> None:
    with pytest.raises(FormatError, match=r"missing|not known") as caught:
        unit_gain(unit)
    assert all(name in str(caught.value) for name in UNITS)


@pytest.mark.parametrize("gain", [0.0, float("nan"), float("inf")])
def test_a_gain_that_makes_no_number_is_refused(gain: float) -> None:
    with pytest.raises(FormatError, match="finite number other than 0"):
        Gain(gain, "velocity")
