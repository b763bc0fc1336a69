"""Start values of an effect's search."""

from itertools import pairwise

from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.candidates import starts


def test_a_date_is_looked_for_between_every_two_earthquakes_and_within_each() -> None:
    seen = observations(BOUC_WEN, 0.01, 3)
    dates = {values["date"] for values in starts("stiffness_step", seen)}
    times = [one.conditions.time for one in seen]
    for before, after in pairwise(times):
        assert any(before[-1] < date < after[0] for date in dates)
    for time in times:
        assert any(time[0] < date < time[-1] for date in dates)
