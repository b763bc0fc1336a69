"""Computations at once: in order, on several processors, and ended by the first error."""

import os
import subprocess
import sys
from collections.abc import Iterator
from threading import Barrier
from time import sleep

import pytest

from core.concurrency import at_once, processors


def test_results_come_in_the_order_of_what_they_are_computed_from() -> None:
    assert list(at_once(lambda number: number**2, range(50))) == [number**2 for number in range(50)]
    assert list(at_once(abs, [])) == []


@pytest.mark.skipif(processors() < 2, reason="one processor computes one thing at a time")
def test_two_computations_wait_for_each_other() -> None:
    """One after the other, the first would wait until the barrier breaks."""
    both = Barrier(2, timeout=30.0)
    assert sorted(at_once(lambda _: both.wait(), "ab")) == [0, 1]


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system binds no process to a processor")
def test_a_process_that_is_bound_to_one_processor_has_one() -> None:
    one = min(os.sched_getaffinity(0))
    bound = f"import os; os.sched_setaffinity(0, [{one}])"
    script = f"{bound}; from core.concurrency import processors; print(processors())"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, check=True).stdout.strip() == b"1"


def test_an_error_is_raised_and_what_has_not_begun_is_left_out() -> None:
    begun = []

    def compute(number: int) -> int:
        begun.append(number)
        if number == 0:
            raise ValueError("no root")
        sleep(1e-3)  # so that all would take seconds
        return number

    with pytest.raises(ValueError, match="no root"):
        list(at_once(compute, range(10_000)))
    assert len(begun) < 10_000


def test_everything_is_asked_for_once() -> None:
    def numbers() -> Iterator[int]:
        yield from (1, 2, 3)

    assert list(at_once(float, numbers())) == [1.0, 2.0, 3.0]
