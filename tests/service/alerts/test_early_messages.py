"""Early messages: what a live stream shows while it shakes, in the thread that ends with the result."""

import re

import pytest
from api_client import client
from cached_executor import CachedExecutor
from live_streams import NOW, RECORDS, SERVER, SETTINGS, follower, received, state
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import early_messages
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.language.choice import speaking
from service.notify.rendering import rendered, with_report
from service.notify.tables import Message
from service.records import events
from service.records.streams.earthquakes import read_shaking
from service.records.tables import Event
from service.settings import Settings

pytestmark = pytest.mark.sqlite


def messages(sessions: sessionmaker[Session]) -> list[Message]:
    with sessions() as session:
        return list(session.scalars(select(Message).order_by(Message.id)))


def at(seconds: int) -> int:
    """Number of packets that begin within so many seconds."""
    return len(RECORDS) * seconds // 240


def test_a_message_while_it_shakes_is_followed_by_the_result(
    sessions: sessionmaker[Session], database_url: str
) -> None:
    one = follower(sessions)
    one.announce = early_messages.write
    one.keep(SERVER, received(RECORDS[: at(115)]))
    one.look()
    assert messages(sessions) == []
    for until in (125, 130, 132):
        one.keep(SERVER, received(RECORDS[: at(until)]))
        one.look()
    (early,) = messages(sessions)
    assert (early.kind, early.sequence, early.severity, early.is_over) == ("event", "new", "note", False)
    assert "gal so far (provisional)" in early.subject
    assert early.data["largest_acceleration"] == pytest.approx(0.3, rel=0.02)
    assert [fact["name"].rpartition(" ")[2] for fact in early.facts] == ["ground", "base", "roof"]
    assert {fact["value"] for fact in early.facts} <= {"30.1 gal", "30.2 gal", "30.3 gal"}
    with sessions() as session, speaking("ja"):
        message = session.scalars(select(Message)).one()
        mail = rendered(session, message, message.created_at, "email", None, is_repeat=False)
        assert "暫定" in mail.subject
        assert "これは暫定値です。" in " ".join(mail.sentences)
        assert with_report(session, message, mail, NOW).report is None
        assert with_report(session, message, mail, NOW).note == mail.note
    with sessions.begin() as session:
        assert session.scalars(select(Event.state)).one() == "gathering"
        assert events.queue_ready(session, NOW, settings=SETTINGS) == 0
    with client(database_url) as api:
        page = api.get("/buildings/TOWER/recordings").text
        assert re.search(r"up to 30.. gal so far \(provisional\)", page)
        assert page.count('<td class="name">XX.TOWER.') == 3
        assert api.get(early.link).status_code == 200
        assert "ライブストリーム" in api.get("/buildings/TOWER/recordings", headers={"Accept-Language": "ja"}).text
    one.keep(SERVER, received(RECORDS))
    one.look()
    assert state(sessions).shaking == []
    Worker(sessions, CachedExecutor, Settings(), KINDS, clock=lambda: NOW).run_until_idle()
    first, last = messages(sessions)
    assert (last.key, last.number, last.sequence) == (first.key, 2, "updated")
    assert not early_messages.is_early(last)
    with sessions() as session:
        assert session.scalars(select(Event.state)).one() in ("analysed", "refused")


def test_another_early_message_comes_when_the_largest_acceleration_has_doubled(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    one.keep(SERVER, received(RECORDS[: at(130)]))
    one.look()
    (shaking,) = read_shaking(state(sessions).shaking)
    with sessions.begin() as session:
        event = events.at(session, one.building, shaking.window.start, shaking.window.end, NOW, NOW - NOW)
        for factor in (1.0, 1.5, 2.1, 4.0, 4.3):
            grown = type(shaking)(shaking.window, {name: factor * peak for name, peak in shaking.peaks.items()})
            early_messages.write(session, one.building, one.described, event, grown)
    assert [message.sequence for message in messages(sessions)] == ["new", "updated", "updated"]


def test_weak_shaking_is_not_announced(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    one.announce, one.settings = early_messages.write, Settings(stream={"announced": 0.4})
    one.keep(SERVER, received(RECORDS[: at(130)]))
    one.look()
    assert len(state(sessions).shaking) == 1
    assert messages(sessions) == []
