"""Trend of a model's error, and when the model no longer fits."""

from dataclasses import asdict
from datetime import UTC, datetime, timedelta

import pytest

from core.comparison.misfit import Misfit
from service.models.answers import Compared, errors_in_the_same_events
from service.models.tables import ModelComparison
from service.models.trend import ABOVE_FLOOR, LEAST, SPARE, EventError, finding, rated
from service.records.tables import Event

START = datetime(2024, 1, 1, tzinfo=UTC)
NOISE = 0.01
"""Share of the force's RMS."""


def seen(number: int, excess: float, *, fitted: bool = False, noise: float = NOISE, direction: str = "x") -> EventError:
    """An event in which noise, and `excess` beside it, are shares of the force's RMS."""
    misfit = Misfit(samples=100, error=excess**2 + noise**2, signal=1.0, spread=1.0, noise=noise**2)
    return EventError(number, START + timedelta(days=number), direction, fitted, misfit)


def missed(*events: EventError) -> list[bool]:
    return [one.is_missed for one in rated(events)]


def compared(role: str, **errors: float) -> Compared:
    """A version's comparisons in one role: by event, the error as a share of the force."""
    return [
        (ModelComparison(event_id=number, direction="x", role=role, misfit=asdict(seen(number, error).misfit)), Event())
        for number, error in ((int(name.removeprefix("event_")), error) for name, error in errors.items())
    ]


def test_versions_are_shown_by_their_errors_in_the_same_events() -> None:
    """The first one's small error in a weak event is not set beside the error of the next in a strong one."""
    design = compared("later", event_1=0.30)
    fitted = [*compared("fitted", event_1=0.10), *compared("later", event_2=0.50)]
    extended = [*compared("fitted", event_1=0.02, event_2=0.05), *compared("held_out", event_3=0.06)]

    def shown(*line: Compared) -> list[tuple[float | None, ...]]:
        each = [(one.fitted, one.held_out, one.later) for one in errors_in_the_same_events(line)]
        return [tuple(None if one is None or one.nrmse is None else round(one.nrmse, 2) for one in row) for row in each]

    assert shown(design, fitted) == [(0.30, None, None), (0.10, None, 0.50)]
    both = round(((0.10**2 + 0.50**2) / 2 + NOISE**2) ** 0.5, 2)
    assert shown(design, fitted, extended) == [(None, None, None), (both, None, None), (0.04, 0.06, None)]


def test_an_event_is_missed_beyond_what_the_model_was_used_to() -> None:
    used_to = seen(1, 0.04, fitted=True)
    assert missed(used_to, seen(2, 0.99 * SPARE * 0.04), seen(3, 1.01 * SPARE * 0.04)) == [False, False, True]


def test_an_earlier_event_that_nothing_was_fitted_to_is_none_of_the_latest() -> None:
    """The model fits everything since: that it fails on old events is said of these, not of the latest."""
    old = [seen(1, 0.5), seen(2, 0.5)]
    assert finding(rated([*old, seen(3, 0.01, fitted=True)])) is None
    assert finding(rated([seen(0, 0.01, fitted=True), *old])) is not None


def test_what_is_not_distinguished_from_an_error_of_the_estimate_is_not_missed() -> None:
    perfect = seen(1, 0.0, fitted=True)
    assert missed(perfect, seen(2, 0.99 * LEAST), seen(3, 1.01 * LEAST)) == [False, False, True]


def test_a_noisy_event_is_not_missed() -> None:
    """An error below ABOVE_FLOOR floors may be noise that was taken too small."""
    perfect, noise = seen(1, 0.0, fitted=True), 0.2
    least = noise * (ABOVE_FLOOR**2 - 1) ** 0.5
    assert missed(perfect, seen(2, 0.99 * least, noise=noise), seen(3, 1.01 * least, noise=noise))[1:] == [
        False,
        True,
    ]


def test_without_a_fit_there_is_nothing_to_be_used_to() -> None:
    assert missed(seen(1, 0.5), seen(2, 0.9)) == [False, False]


@pytest.mark.parametrize(
    ("later", "severity"),
    [
        ((), None),
        ((0.0,), None),
        ((0.5,), "note"),
        ((0.5, 0.0), None),
        ((0.5, 0.0, 0.5), "note"),
        ((0.5, 0.5), "warning"),
    ],
)
def test_two_missed_in_a_row_are_a_warning(later: tuple[float, ...], severity: str | None) -> None:
    events = [seen(0, 0.03, fitted=True), *(seen(n, excess) for n, excess in enumerate(later, 1))]
    found = finding(rated(events))
    assert (found and found.severity) == severity
    if found:
        assert "50.0 % of the force" in found.message
        assert "4.5 %" in found.message


@pytest.mark.parametrize(
    ("later", "severity"),
    [
        (((0.5, 0.5),), "note"),
        (((0.5, 0.0),), "note"),
        (((0.0, 0.5), (0.5, 0.0)), "warning"),
        (((0.5, 0.5), (0.0, 0.0)), None),
    ],
)
def test_an_event_counts_once_and_is_missed_if_it_is_in_one_of_two_directions(
    later: tuple[tuple[float, float], ...], severity: str | None
) -> None:
    events = [seen(0, 0.03, fitted=True)]
    events += [seen(n, e, direction=d) for n, pair in enumerate(later, 1) for d, e in zip("xy", pair, strict=True)]
    found = finding(rated(events))
    assert (found and found.severity) == severity
