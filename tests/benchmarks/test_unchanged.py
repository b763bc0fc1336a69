"""The comparison of two recordings shows every value that differs, and none that may."""

import pytest

from benchmarks.unchanged import Value, differences

BEFORE: Value = {
    "outcome": "effect",
    "named": ["hardening"],
    "error": 0.25,
    "is_sure": True,
    "peak": None,
    "analysed_at": "2026-11-22T16:00:00Z",
    "event": {"k_eq": [4.0e6, 5.0e6]},
}


def changed(**values: Value) -> Value:
    """The recording with other values."""
    assert isinstance(BEFORE, dict)
    return {**BEFORE, **values}


def test_equal_recordings_do_not_differ() -> None:
    assert not list(differences(BEFORE, changed()))


@pytest.mark.parametrize(
    "after", [changed(error=0.25 * (1 + 5e-10)), changed(analysed_at="2026-11-23T16:00:00Z"), changed(error=0.25 + 0)]
)
def test_rounding_and_times_are_no_differences(after: Value) -> None:
    assert not list(differences(BEFORE, after))


@pytest.mark.parametrize(
    ("after", "place"),
    [
        (changed(outcome="unknown"), "/outcome"),
        (changed(named=[]), "/named"),
        (changed(error=0.25 * (1 + 2e-9)), "/error"),
        (changed(is_sure=1), "/is_sure"),
        (changed(peak=0.0), "/peak"),
        (changed(event={"k_eq": [4.0e6, 5.1e6]}), "/event/k_eq/1"),
        (changed(event={}), "/event/k_eq"),
        (changed(more=1), "/more"),
    ],
)
def test_every_other_difference_is_shown_with_its_place(after: Value, place: str) -> None:
    [line] = differences(BEFORE, after)
    assert line.startswith(f"{place}: ")
