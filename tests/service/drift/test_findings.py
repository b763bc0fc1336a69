"""Alert candidates from all series of a building."""

from zoneinfo import ZoneInfo

from drift_histories import Plan, history, series, series_in_both_directions

from core.drift.monitor import Monitoring, Reference
from service.drift.alert_candidates import drift_candidates
from service.drift.monitoring import SeriesInputs, monitored

PLAN = Plan(events=80, giant=False, outliers=0.0, scatter=(0.01, 0.01))
ONSET = 45


def both(loss: float) -> tuple[tuple[Monitoring, tuple[str, ...]], ...]:
    """The layer in x and in y, which loses as much in both from an earthquake on; each with its own sensor."""
    sides = series_in_both_directions(PLAN, 31, ONSET, loss)
    watched = [SeriesInputs(one, Reference(), {}, None, (f"XX.D.01.HN{one.subject}",)) for one in sides]
    return tuple((found, of.channels) for of, found in monitored(watched))


def test_a_loss_in_both_directions_covers_their_mean_too() -> None:
    watched = both(0.04)
    starts = {value.event: value.time for value in watched[0][0].values}
    found = {one.cause: one for one in drift_candidates(watched, starts, ZoneInfo("UTC"))}
    together = found["stiffness/xy"]
    assert together.is_sure
    assert together.summary.endswith("% softer in both directions on average")
    assert together.channels == ("XX.D.01.HNx", "XX.D.01.HNy")
    assert together.evidence["low"] < -0.04 < together.evidence["high"]
    assert all(together.raised_at <= found[one].raised_at for one in ("stiffness/x", "stiffness/y") if one in found)


def test_of_one_direction_alone_there_is_no_mean() -> None:
    lived = series(history(PLAN, 31))
    ((_, found),) = monitored([SeriesInputs(lived, Reference(), {}, None, ())])
    assert found.series == lived
