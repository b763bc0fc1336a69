"""Numbers are printed to the digit that their uncertainty supports: the Particle Data Group's examples, and for any."""

from math import inf, nan

import pytest
from hypothesis import example, given, strategies as st

from core.rounding import LONG, SHORT, interval, plain, significant, with_std
from core.units import percent_in_table

REGULAR = st.floats(SHORT, 0.9 * LONG)
VALUES = st.floats(-0.9 * LONG, 0.9 * LONG)
FINITE = st.floats(-1e300, 1e300)


def number(text: str) -> float:
    return float(text.replace("−", "-").replace(",", ""))


def decimals(text: str) -> int:
    return len(text.partition(".")[2])


@pytest.mark.parametrize(
    ("value", "std", "written"),
    [
        (0.827, 0.119, "0.83 ± 0.12"),
        (0.827, 0.367, "0.8 ± 0.4"),
        (3294.4, 0.34, "3,294.40 ± 0.34"),
        (3294.4, 96.0, "3,290 ± 100"),
        (17617.6, 720.0, "17,600 ± 700"),
        (-0.0123, 0.0004, "−0.0123 ± 0.0004"),
        (-0.01, 3.0, "0.0 ± 3.0"),
        (3.0, 120.0, "0 ± 120"),
        (6.012e10, 5.9e8, "(6.01 ± 0.06) · 10¹⁰"),
        (2.5e-6, 3e-7, "(2.50 ± 0.30) · 10⁻⁶"),
        (3294.4, 0.0, "3,290"),
        (3294.4, None, "3,290"),
        (12.0, None, "12.0"),
        (0.0, None, "0"),
        (3294.4, inf, "3,290 (not determined)"),
        (nan, 1.0, "not determined"),
    ],
)
def test_a_value_ends_where_its_standard_deviation_does(value: float, std: float | None, written: str) -> None:
    """The first two are the rule's own: 0.827 ± 0.119 and ± 0.367."""
    assert with_std(value, std) == written
    assert with_std(value, std, "kN").endswith(" kN") == (value == value)


@given(VALUES, REGULAR)
def test_value_and_standard_deviation_share_their_last_place_and_it_is_rounded_there(value: float, std: float) -> None:
    first, second = with_std(value, std).split(" ± ")
    assert decimals(first) == decimals(second)
    assert abs(number(second) / std - 1) < 0.15  # 0.355 becomes 0.4
    assert abs(number(first) - value) <= 0.15 * std  # half of a last place that is at most 1 / 3.55 of it
    assert first != "−0"


@given(REGULAR, REGULAR)
def test_a_standard_deviation_has_one_digit_or_two(value: float, std: float) -> None:
    written = with_std(value, std).split(" ± ")[1].replace(",", "")
    digits = written.replace(".", "").lstrip("0")
    assert len(digits.rstrip("0")) <= 2
    if "." in written:
        assert len(digits) <= 2


@given(VALUES, REGULAR)
def test_an_interval_is_written_to_one_place_that_its_width_supports(value: float, half: float) -> None:
    written = interval(value, value - half, value + half, "%")
    middle, ends = written.split(" % (95 %: ")
    low, high = ends.removesuffix(" %)").split(" to ")
    assert decimals(middle) == decimals(low) == decimals(high)
    for text, end in ((low, value - half), (middle, value), (high, value + half)):
        assert abs(number(text) - end) <= 0.15 * half + 1e-9 * abs(end)


def test_an_interval_reads_as_a_change() -> None:
    assert interval(-8.12, -9.93, -6.21, "%") == "−8.1 % (95 %: −9.9 to −6.2 %)"
    assert interval(12.0, 9.0, 15.0, signed=False) == "12.0 (95 %: 9.0 to 15.0)"


@given(st.floats(-1e12, 1e12).filter(lambda value: abs(value) > 1e-12), st.integers(2, 6))
def test_a_value_of_unknown_uncertainty_has_its_first_digits(value: float, digits: int) -> None:
    number_, _, power = significant(value, digits).partition(" · 10")
    exponent = int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))) if power else 0
    assert abs(number(number_) * 10.0**exponent / value - 1) <= 0.5 * 10.0 ** (1 - digits) * (1 + 1e-9)


def test_a_value_that_was_set_has_no_zeros_at_its_end() -> None:
    assert [plain(value) for value in (12.0, 655.4, 0.05, 2e9, 0.0, 100.0)] == [
        "12",
        "655.4",
        "0.05",
        "2 · 10⁹",
        "0",
        "100",
    ]


@given(FINITE | st.sampled_from([nan, inf, -inf]), FINITE.map(abs) | st.sampled_from([nan, inf, None]))
@example(-1.1e-311, None)
@example(1e-320, 1e300)
@example(1e300, 1e300)
def test_every_number_can_be_written(value: float, std: float | None) -> None:
    assert significant(value)
    assert plain(value)
    assert with_std(value, std)
    assert interval(value, value - (std or 0.0), value + (std or 0.0))


@pytest.mark.parametrize(
    ("share", "written"),
    [
        (0.0, "< 0.1 %"),
        (4.9e-4, "< 0.1 %"),
        (-4e-4, "< 0.1 %"),
        (5.1e-4, "0.1 %"),
        (0.123, "12.3 %"),
        (1.0, "100 %"),
        (-0.02, "-2.0 %"),
    ],
)
def test_a_share_that_rounds_to_nothing_is_said_to_be_less_than_the_last_digit(share: float, written: str) -> None:
    assert percent_in_table(share) == written
