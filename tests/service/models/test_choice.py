"""Earthquakes that a diagnosis works with by default."""

from datetime import UTC, datetime, timedelta
from itertools import pairwise

from hypothesis import given, strategies as st

from service.models.choice import MOST, STRONG, Moved, chosen

START = datetime(2024, 1, 1, tzinfo=UTC)
AMPLITUDES = st.lists(st.floats(1e-4, 0.5), min_size=1, max_size=60)


def earthquakes(*amplitudes: float) -> list[Moved]:
    return [Moved(number, START + number * timedelta(days=1), x) for number, x in enumerate(amplitudes, 1)]


@given(AMPLITUDES, st.data())
def test_the_earthquake_and_the_strongest_are_fitted_and_a_strong_one_tests_the_result(
    amplitudes: list[float], data: st.DataObject
) -> None:
    there = earthquakes(*amplitudes)
    event = data.draw(st.sampled_from(there)).event
    made = chosen(there, event)
    by_use = {use: [one.moved for one in made if one.use == use] for use in ("fit", "hold_out", "aside")}
    strongest = max(amplitudes)
    assert event in {one.event for one in by_use["fit"]}
    assert strongest in {one.displacement for one in by_use["fit"]}
    assert len(by_use["fit"]) + len(by_use["hold_out"]) == min(len(there), MOST)
    assert all(one.displacement >= STRONG * strongest for one in by_use["hold_out"])
    assert len(by_use["hold_out"]) <= 1
    assert [one.moved.start for one in made] == sorted((one.moved.start for one in made), reverse=True)


def test_of_the_demonstrations_earthquakes_the_latest_strong_one_is_held_out() -> None:
    there = earthquakes(0.006, 0.012, 0.025, 0.15, 0.14, 0.26)
    assert [one.moved.event for one in chosen(there, 6) if one.use == "hold_out"] == [5]
    assert [one.moved.event for one in chosen(there, 5) if one.use == "hold_out"] == [4]


def test_weak_earthquakes_test_nothing() -> None:
    assert {one.use for one in chosen(earthquakes(0.01, 0.02, 0.2), 3)} == {"fit"}


def test_of_many_earthquakes_all_amplitudes_are_fitted() -> None:
    there = earthquakes(*(0.001 * 1.1**number for number in range(50)))
    used = sorted(one.moved.displacement for one in chosen(there, 25) if one.use != "aside")
    assert used[0] == there[0].displacement
    assert max(after / before for before, after in pairwise(used)) < 2.5
