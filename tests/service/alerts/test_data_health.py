"""Times at which data count as stopped, to the second."""

from dataclasses import replace
from datetime import datetime, timedelta

import pytest
from alert_candidates import DAY, START

from service.alerts import data_health
from service.alerts.data_health import Sighting, Source, Thresholds, Work

HOUR, SECOND = timedelta(hours=1), timedelta(seconds=1)
PATIENCE = Thresholds(
    source=HOUR,
    continuous=2 * HOUR,
    quiet=100 * DAY,
    misses=3,
    clock=timedelta(seconds=60),
    worker=HOUR / 2,
    reserve=1000,
)
SOURCE = Source(
    is_continuous=False,
    watched_since=START,
    described_at=START,
    attempted_at=START + DAY,
    succeeded_at=START + DAY + SECOND,
    failing_since=None,
    error=None,
    last_record=START + DAY,
    ahead=-SECOND,
    came_at=START + DAY + SECOND,
    server_ahead=None,
)
FAILING = replace(SOURCE, attempted_at=START + 2 * DAY, failing_since=START + 2 * DAY, error="503")
HANGING = replace(SOURCE, attempted_at=START + 2 * DAY)


@pytest.mark.parametrize("source", [FAILING, HANGING], ids=["failing", "hanging"])
def test_a_source_stops_when_patience_ends(source: Source) -> None:
    assert not list(data_health.stopped_source(source, PATIENCE, START + 2 * DAY + HOUR))
    (found,) = data_health.stopped_source(source, PATIENCE, START + 2 * DAY + HOUR + SECOND)
    assert (found.cause, found.began_at, found.raised_at) == ("source", START + 2 * DAY, START + 2 * DAY + HOUR)


@pytest.mark.parametrize(
    ("answered", "summary"),
    [
        (None, "The monitoring server has never answered at its address"),
        (START + DAY, "The monitoring server has not answered since the building file was changed"),
    ],
)
def test_a_source_that_is_silent_since_a_change_is_said_at_once(answered: datetime | None, summary: str) -> None:
    """Its address may be wrong; whether it ever answered is said as it is."""
    silent = replace(FAILING, succeeded_at=answered, described_at=START + 2 * DAY)
    (found,) = data_health.stopped_source(silent, PATIENCE, START + 2 * DAY + SECOND)
    assert (found.raised_at, found.summary) == (START + 2 * DAY, summary)


def test_a_service_that_was_down_blames_no_source() -> None:
    assert not list(data_health.stopped_source(SOURCE, PATIENCE, START + 50 * DAY))


@pytest.mark.parametrize(("is_continuous", "longest"), [(True, 2 * HOUR), (False, 100 * DAY)])
def test_records_stop_when_patience_ends(is_continuous: bool, longest: timedelta) -> None:
    source = replace(SOURCE, is_continuous=is_continuous)
    assert not list(data_health.stopped_records(source, PATIENCE, START + DAY + longest))
    (found,) = data_health.stopped_records(source, PATIENCE, START + DAY + longest + SECOND)
    assert (found.cause, found.began_at) == ("record", START + DAY)


def test_records_of_long_ago_count_from_when_the_building_came_under_watch() -> None:
    source = replace(SOURCE, last_record=START - 1000 * DAY)
    assert not list(data_health.stopped_records(source, PATIENCE, START + 100 * DAY))
    assert list(data_health.stopped_records(source, PATIENCE, START + 101 * DAY))


def test_clocks_may_be_off_by_a_tolerance() -> None:
    minute = timedelta(seconds=60)
    assert not list(data_health.wrong_clocks(replace(SOURCE, ahead=minute, server_ahead=-minute), PATIENCE))
    late = replace(SOURCE, ahead=minute + SECOND, server_ahead=-minute - SECOND)
    recorder, server = data_health.wrong_clocks(late, PATIENCE)
    assert (recorder.cause, server.cause) == ("clock/recorder", "clock/server")
    assert "behind" in server.sentences[0]


def sightings(*channels: str) -> list[Sighting]:
    """An earthquake a day, with these channels, each a letter."""
    return [Sighting(event=n, start=START + n * DAY, channels=set(there)) for n, there in enumerate(channels)]


def test_a_channel_is_dead_after_so_many_misses_in_a_row() -> None:
    assert not list(data_health.dead_channels(sightings("ab", "a", "ab", "a", "a"), "ab", "ab", PATIENCE))
    (found,) = data_health.dead_channels(sightings("ab", "b", "ab", "a", "a", "a", "a"), "ab", "ab", PATIENCE)
    assert (found.cause, found.channels) == ("channel/b", ("b",))
    assert (found.began_at, found.raised_at) == (START + 3 * DAY, START + 5 * DAY)


def test_a_channel_that_never_gave_anything_or_is_the_buildings_no_more_is_not_dead() -> None:
    assert not list(data_health.dead_channels(sightings("a", "a", "a"), "ab", "a", PATIENCE))
    assert not list(data_health.dead_channels(sightings("a", "a", "a"), "a", "ab", PATIENCE))


def test_a_channel_is_silent_when_patience_ends() -> None:
    silent = {"b": START, "a": START + HOUR}
    assert not list(data_health.silent_channels(silent, PATIENCE, START + HOUR))
    (found,) = data_health.silent_channels(silent, PATIENCE, START + HOUR + SECOND)
    assert (found.cause, found.channels, found.began_at) == ("channel/b", ("b",), START)
    assert found.raised_at == START + HOUR
    assert len(list(data_health.silent_channels(silent, PATIENCE, START + 3 * HOUR))) == 2


def test_work_is_stuck_only_while_nothing_gets_done() -> None:
    now = START + DAY
    long_ago, lately = now - HOUR, now - SECOND
    assert not list(data_health.stuck_work(Work(oldest=None, last_progress=None), PATIENCE, now))
    assert not list(data_health.stuck_work(Work(oldest=lately, last_progress=None), PATIENCE, now))
    assert not list(data_health.stuck_work(Work(oldest=long_ago, last_progress=lately), PATIENCE, now))
    for progress in (None, long_ago - DAY):
        (found,) = data_health.stuck_work(Work(oldest=long_ago, last_progress=progress), PATIENCE, now)
        assert (found.cause, found.began_at) == ("worker", long_ago)


def test_a_disk_is_full_below_its_reserve_until_there_is_more_room_than_that() -> None:
    assert not list(data_health.full_disk(1000, PATIENCE, None, START))
    (found,) = data_health.full_disk(999, PATIENCE, None, START)
    assert found.began_at == START
    (still,) = data_health.full_disk(1249, PATIENCE, START, START + DAY)
    assert still.began_at == START
    assert not list(data_health.full_disk(1250, PATIENCE, START, START + DAY))
