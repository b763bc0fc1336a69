"""The latency of a live stream, as the metrics and the page show it: a channel that is silent hides behind no other."""

import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from alert_fixtures import states
from api_client import client
from live_streams import NOW, SERVER, follower, received
from monitoring_server import LOCATIONS, building_file, miniseed, stream
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.periodic_checks import check_buildings
from service.buildings import store as building_store
from service.health.metrics import latencies
from service.notify.tables import Message
from service.records.streams import flow
from service.records.streams.flow import Flow
from service.records.streams.follower import Follower
from service.settings import Settings

pytestmark = pytest.mark.sqlite
SENDING = ("XX.TOWER.00.HNX", "XX.TOWER.01.HNX")
SILENT = "XX.TOWER.02.HNX"


def send(one: Follower, end: datetime, locations: tuple[str, ...] = LOCATIONS, *, is_new: bool = False) -> None:
    """Ten seconds of data of these channels until `end`, which come a second later."""
    sent = miniseed(stream(end - timedelta(seconds=10), 10, locations))
    one.clock = lambda: end + timedelta(seconds=1)
    one.keep(SERVER, received([sent[at : at + 512] for at in range(0, len(sent), 512)]), is_new=is_new)


def latency(sessions: sessionmaker[Session], now: datetime) -> float:
    with sessions() as session:
        return latencies(session, now)["TOWER"]


def cells(page: str, channel: str) -> list[str]:
    """Cells of a channel's row in the page's table, without tags."""
    (row,) = re.findall(rf'<tr><td class="name">{re.escape(channel)}(<td.*)', page)
    return [re.sub("<[^>]*>", "", cell) for cell in row.split("<td")[1:]]


def test_a_silent_channel_shows_in_the_metric_and_on_the_page(
    sessions: sessionmaker[Session], database_url: str
) -> None:
    now = datetime.now(UTC)
    one = follower(sessions)
    send(one, now - timedelta(minutes=10), is_new=True)
    for seconds in (30, 20, 10, 1):
        send(one, now - timedelta(seconds=seconds), ("00", "01"))
    with client(database_url) as api:
        answer, page = api.get("/metrics").text, api.get("/buildings/TOWER/recordings").text
        japanese = api.get("/buildings/TOWER/recordings", headers={"Accept-Language": "ja"}).text
    metrics = {one.name: one.samples for one in text_string_to_metric_families(answer)}
    (behind,) = metrics["menshin_stream_latency_seconds"]
    assert 600 <= behind.value < 660, "a minute for a busy machine"
    assert re.search(rf"channel {re.escape(SILENT)} has been silent since <time", page)
    assert page.count("has been silent since") == 1
    assert re.search(r"6[0-5]\d\.\d s, of the slowest channel", page)
    assert f"チャンネル {SILENT} のデータが" in japanese
    shown = {channel: float(cells(page, channel)[1].split(">")[1].removesuffix(" s")) for channel in (*SENDING, SILENT)}
    assert 600 <= shown[SILENT] < 660
    assert all(1 <= shown[channel] < 61 for channel in SENDING)


def test_the_page_shows_the_numbers_of_each_channel(sessions: sessionmaker[Session], database_url: str) -> None:
    now = datetime.now(UTC)
    one = follower(sessions)
    send(one, now - timedelta(seconds=90), is_new=True)
    send(one, now - timedelta(seconds=60), ("01",))
    with client(database_url) as api:
        page = api.get("/buildings/TOWER/recordings").text
    assert [cell.split(">")[1] for cell in cells(page, SENDING[0])[2:]] == ["0", "0.0 s"]
    assert [cell.split(">")[1] for cell in cells(page, SENDING[1])[2:]] == ["1", "20.0 s"]
    assert "silent since" not in page, "for less than `stream.silence`"


def test_the_latency_grows_from_the_last_sample_of_the_slowest_channel(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    send(one, NOW, is_new=True)
    assert latency(sessions, NOW + timedelta(seconds=1)) == pytest.approx(1.01)
    for seconds in (10, 20):
        send(one, NOW + timedelta(seconds=seconds), ("00", "01"))
    assert latency(sessions, NOW + timedelta(seconds=21)) == pytest.approx(21.01)
    send(one, NOW + timedelta(seconds=20), ("02",))
    assert latency(sessions, NOW + timedelta(seconds=21)) == pytest.approx(1.01)


def test_a_channel_that_never_sent_counts_from_the_first_connection(
    sessions: sessionmaker[Session], database_url: str
) -> None:
    one = follower(sessions)
    one.keep(SERVER, [], is_new=True)
    for minutes in (1, 2, 3):
        send(one, NOW + timedelta(minutes=minutes), ("00", "01"), is_new=True)
    assert latency(sessions, NOW + timedelta(minutes=4)) == 240
    with client(database_url) as api:
        page = api.get("/buildings/TOWER/recordings").text
    assert f"channel {SILENT} has sent nothing since the connection of" in page
    assert cells(page, SILENT)[0].endswith(">none yet")
    send(one, NOW + timedelta(minutes=4), is_new=True)
    assert latency(sessions, NOW + timedelta(minutes=4)) == pytest.approx(0.01)
    with sessions() as session:
        (channels,) = [flow.read(state.channels) for state in session.query(flow.StreamState)]
    assert (channels[SILENT].gaps, channels[SILENT].missing) == (0, 0.0)


def test_a_silent_channel_raises_an_alert_until_it_sends_again(sessions: sessionmaker[Session]) -> None:
    """Neither the time without a connection nor that before a restart of the service counts, nor does a new one hide
    the silence."""
    one, rounds = follower(sessions), Settings(disk_reserve=0)

    def checked(minutes: float, locations: tuple[str, ...] = ("00", "01"), *, is_new: bool = False) -> dict[str, str]:
        now = NOW + timedelta(minutes=minutes)
        send(one, now, locations, is_new=is_new)
        check_buildings(sessions, rounds, now + timedelta(seconds=5))
        return states(sessions)

    assert checked(0, LOCATIONS, is_new=True) == {}
    assert checked(200, is_new=True) == {}, "the service was down"
    assert checked(259) == {}
    assert checked(261) == {f"channel/{SILENT}": "active"}
    assert checked(262, is_new=True) == {f"channel/{SILENT}": "active"}
    with sessions() as session:
        (message,) = session.query(Message)
        assert message.sentences[0].startswith(f"Sensor {SILENT} has sent nothing for more than 60 minutes, since")
        assert "have this sensor and its cable checked" in " ".join(message.sentences)
    assert checked(263, LOCATIONS) == {f"channel/{SILENT}": "resolved"}
    assert checked(300, ("02",)) == {f"channel/{SILENT}": "resolved"}
    assert set(checked(420, ("02",)).items()) >= {(f"channel/{channel}", "active") for channel in SENDING}
    with sessions.begin() as session:
        building_store.update_description(session, building_file(), Path("/"), NOW + timedelta(minutes=421))
    check_buildings(sessions, rounds, NOW + timedelta(minutes=422))
    assert {states(sessions)[f"channel/{channel}"] for channel in SENDING} == {"resolved"}, "it is no stream any more"


def test_channels_that_are_no_longer_described_and_former_streams_have_no_latency(
    sessions: sessionmaker[Session],
) -> None:
    one = follower(sessions)
    send(one, NOW, is_new=True)
    send(one, NOW + timedelta(minutes=9), ("00", "01"))
    text = building_file("seedlink", SERVER.address)
    fewer = text.replace(SILENT, "XX.TOWER.03.HNX")
    for described, expected in ((fewer, {"TOWER": 599.0}), (building_file(), {})):
        with sessions.begin() as session:
            building_store.update_description(session, described, Path("/"), NOW)
        with sessions() as session:
            assert latencies(session, NOW + timedelta(minutes=10)) == expected


def test_a_clock_that_is_ahead_hides_no_silence() -> None:
    ahead = Flow(NOW + timedelta(hours=2), NOW, 0, 0.0)
    assert ahead.latency(NOW) == 0
    assert ahead.latency(NOW + timedelta(minutes=3)) == 180
    assert ahead.is_silent(NOW + timedelta(minutes=3), timedelta(minutes=2))


def test_flows_of_earlier_versions_are_read_and_all_are_read_back() -> None:
    earlier = {"A": {"reached": NOW.isoformat(), "latency": 2.5, "gaps": 1, "missing": 0.5}}
    flows = {"A": Flow(NOW, NOW + timedelta(seconds=2.5), 1, 0.5)}
    assert flow.read(earlier) == flows
    every = flows | {"B": Flow(NOW, NOW, 0, 0.0, has_sent=False)}
    assert flow.read(flow.written(every)) == every
