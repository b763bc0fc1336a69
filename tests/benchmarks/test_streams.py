"""The benchmark of live streams says what was missed: its goal, a message that never came, and packets."""

from collections.abc import Mapping

import pytest

from benchmarks.streams import CUT, EARLY, GOAL, MESSAGE, RESULT, THINGS, TRIGGER, Kept, failures

REACHED = {TRIGGER: -39.0, EARLY: -36.8, CUT: 27.5, RESULT: 30.5, MESSAGE: 32.0}
WHOLE = Kept(stored=253, refused=0, missing=0.0)


def test_nothing_is_said_of_a_run_that_reached_the_goal() -> None:
    assert failures(REACHED, 253, WHOLE) == []
    assert failures(REACHED | {RESULT: GOAL}, 253, WHOLE) == [], "the goal itself is reached"
    assert tuple(REACHED) == THINGS


@pytest.mark.parametrize(
    ("noted", "found", "said"),
    [
        (REACHED | {RESULT: 60.1}, WHOLE, "the result came 60.1 s after the end, and the goal is 60 s"),
        (REACHED, Kept(252, 0, 0.0), "252 packets are in the database, and 253 were sent"),
        (REACHED, Kept(254, 0, 0.0), "254 packets are in the database, and 253 were sent"),
        (REACHED, Kept(253, 2, 0.0), "2 packets could not be used"),
        (REACHED, Kept(253, 0, 3.04), "3.0 s are missing in the channels together"),
    ],
)
def test_what_failed_is_said(noted: Mapping[str, float], found: Kept, said: str) -> None:
    assert failures(noted, 253, found) == [said]


@pytest.mark.parametrize("name", THINGS)
def test_what_never_came_is_said(name: str) -> None:
    noted = {one: at for one, at in REACHED.items() if one != name}
    assert failures(noted, 253, WHOLE) == [f"{name} did not come within 120 s after the end"]
