"""The order in which a flood's queue was served is judged by who waited, and by nothing else."""

from datetime import UTC, datetime, timedelta

import pytest

from benchmarks.queue_order import Order, order

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def at(*seconds: float) -> list[datetime]:
    return [NOW + timedelta(seconds=one) for one in seconds]


@pytest.mark.parametrize(
    ("came", "served", "found"),
    [
        pytest.param((0, 0, 0), (30, 20, 10), Order(0, 3), id="the most urgent first"),
        pytest.param((0, 0, 0), (10, 20, 30), Order(2, 0), id="the least urgent before two that waited"),
        pytest.param((0, 15, 25), (10, 20, 30), Order(0, 0), id="each before the next one came"),
        pytest.param((0, 10, 20), (30, 31, 29), Order(1, 2), id="one of the two that came later was passed over"),
        pytest.param((0, 9.5, 9.5), (10, 20, 15), Order(0, 1), id="what came just now may not be seen yet"),
    ],
)
def test_the_order_of_a_queue(came: tuple[float, ...], served: tuple[float, ...], found: Order) -> None:
    """The third is the most urgent."""
    assert order((3.0, 2.0, 1.0), at(*came), at(*served), at(*served)) == found
