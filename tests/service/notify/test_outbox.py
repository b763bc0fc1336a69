"""The outbox: news, recipients, and one transaction with the news itself."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Thread

import pytest
from monitoring_server import building_file
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS
from service.notify.outbox import MessageContent, put
from service.notify.tables import Delivery, Message, Receiver

NOW = datetime(2024, 1, 1, tzinfo=UTC)


@pytest.fixture
def building(sessions: sessionmaker[Session]) -> int:
    with sessions.begin() as session:
        return building_store.add(session, building_file(), Path("/"), NOW).id


def add(session: Session, building_id: int, name: str, **rule: list[str]) -> Receiver:
    wanted = {"kinds": list(WANTED_KINDS), "severities": list(SEVERITIES)} | rule
    receiver = Receiver(
        building_id=building_id,
        name=name,
        kind="email",
        address=f"{name}@example.org",
        origin="api",
        created_at=NOW,
        **wanted,
    )
    session.add(receiver)
    session.flush()
    return receiver


def notice(building_id: int, **other: object) -> MessageContent:
    printed = MessageContent("event/1", building_id, "event", "new", "normal", "Earthquake", ("8 of 8 checks passed.",))
    return replace(printed, **other)  # type: ignore[arg-type]


def reported(session: Session, message: Message) -> list[str]:
    question = select(Receiver.name).join(Delivery, Delivery.receiver_id == Receiver.id)
    return list(session.scalars(question.where(Delivery.message_id == message.id).order_by(Receiver.name)))


def test_every_receiver_whose_rule_it_meets(sessions: sessionmaker[Session], building: int) -> None:
    with sessions.begin() as session:
        add(session, building, "all")
        add(session, building, "alarms", severities=["alarm"])
        add(session, building, "alerts", kinds=["alert"])
        add(session, building, "gone").removed_at = NOW
        assert reported(session, put(session, notice(building), NOW)) == ["all"]
        alarm = notice(building, key="alert/1", kind="alert", severity="alarm")
        assert reported(session, put(session, alarm, NOW)) == ["alarms", "alerts", "all"]


def test_what_was_reported_last_is_no_news(sessions: sessionmaker[Session], building: int) -> None:
    with sessions.begin() as session:
        add(session, building, "all")
        first = put(session, notice(building), NOW)
        again = notice(building, sequence="updated", data={"peak": 0.1}, link="/elsewhere", picture=None)
        assert put(session, again, NOW + timedelta(hours=1)) is first
        changed = notice(building, sequence="updated", sentences=("The layer moved by 30 mm.",))
        assert put(session, changed, NOW).number == 2
        assert put(session, again, NOW).number == 3, "what was told before the last is news again"
        assert put(session, replace(again, sequence="repeat"), NOW).number == 4
        assert put(session, replace(again, key="event/2"), NOW).number == 1


def test_whoever_was_reported_learns_what_became_of_it(sessions: sessionmaker[Session], building: int) -> None:
    alarm = notice(building, key="alert/1", kind="alert", severity="alarm")
    with sessions.begin() as session:
        add(session, building, "alarms", severities=["alarm"])
        add(session, building, "calm", severities=["normal"])
        put(session, alarm, NOW)
        over = put(session, replace(alarm, sequence="updated", severity="normal", subject="Resolved"), NOW)
        assert reported(session, over) == ["alarms", "calm"]


def test_a_message_is_stored_only_if_its_transaction_commits(sessions: sessionmaker[Session], building: int) -> None:
    with sessions() as session:
        add(session, building, "all")
        put(session, notice(building), NOW)
        session.rollback()
    with sessions() as session:
        assert session.scalars(select(Message)).all() == []
        assert session.scalars(select(Delivery)).all() == []


def test_news_of_one_thing_in_many_transactions_at_once_is_put_once(
    sessions: sessionmaker[Session], building: int
) -> None:
    def put_one() -> None:
        with sessions.begin() as session:
            put(session, notice(building), NOW)

    threads = [Thread(target=put_one) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with sessions() as session:
        assert len(session.scalars(select(Message)).all()) == 1


def test_a_message_keeps_all_that_the_notice_stated(sessions: sessionmaker[Session], building: int) -> None:
    printed = notice(building, facts=(("Largest displacement", "31 mm"),), data={"peak_displacement": 0.031})
    with sessions.begin() as session:
        put(session, printed, NOW)
    with sessions() as session:
        message = session.scalars(select(Message)).one()
        assert message.facts == [{"name": "Largest displacement", "value": "31 mm"}]
        assert (message.data, message.sentences) == ({"peak_displacement": 0.031}, ["8 of 8 checks passed."])
        assert message.identity.startswith("msg_")
