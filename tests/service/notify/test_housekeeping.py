"""Periodic work of a notifier: repetitions of active alerts, and the heartbeat while all parts work."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from building_files import SMALL
from receivers import WebhookServer, webhook_server
from sqlalchemy import delete
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.tables import Alert
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, STANDING, ReceiverRule
from service.db import process_leases
from service.db.process_leases import POLLING, WORKING
from service.jobs.tables import Lease
from service.notify.housekeeping import Housekeeping
from service.notify.notifier import Notifier
from service.notify.outbox import MessageContent, put
from service.settings import Settings

NOW = datetime(2024, 1, 1, tzinfo=UTC)


@dataclass(slots=True)
class Clock:
    """A clock that stands until it is moved."""

    now: datetime = NOW

    def __call__(self) -> datetime:
        return self.now

    def on(self, seconds: float) -> None:
        self.now += timedelta(seconds=seconds)

    def timer(self) -> float:
        return (self.now - NOW).total_seconds()


@pytest.fixture
def there() -> Iterator[WebhookServer]:
    with webhook_server() as server:
        server.status = 200
        yield server


@pytest.fixture
def building(sessions: sessionmaker[Session]) -> int:
    with sessions.begin() as session:
        return building_store.add(session, SMALL, Path("/"), NOW).id


def settings(there: WebhookServer) -> Settings:
    return Settings(
        inside_allowed=("localhost",),
        plain_http_allowed=True,
        alertmanager_interval=30,
        heartbeat_url=f"{there.address}/ping/secret",  # type: ignore[arg-type]
        heartbeat_interval=60,
    )


def ends(there: WebhookServer) -> list[datetime]:
    """End of a pushed alert unless it is pushed again."""
    pushed = [one for one in there.posted if one.path.endswith("/alerts")]
    return [datetime.fromisoformat(json.loads(one.body)[0]["endsAt"]) for one in pushed]


def test_an_active_alert_is_repeated_until_it_ends(
    sessions: sessionmaker[Session], building: int, there: WebhookServer
) -> None:
    clock = Clock()
    alarm = MessageContent("alert/1", building, "alert", "new", "alarm", "Softer", ("The isolators are softer.",))
    rule = ReceiverRule("am", "alertmanager", there.address, None, STANDING, SEVERITIES)
    with sessions.begin() as session:
        recipients.add(session, building, rule, "engineer", NOW)
        put(session, alarm, NOW)
    notifier = Notifier(sessions, settings(there), clock)
    upkeep = Housekeeping(sessions, settings(there), clock, timer=clock.timer)
    notifier.run_until_idle()
    upkeep.step()
    assert ends(there) == [NOW + timedelta(seconds=120)]
    for _ in range(3):
        clock.on(30)
        upkeep.step()
    assert ends(there) == [NOW + timedelta(seconds=120 + 30 * number) for number in range(4)]
    there.status = 503
    clock.on(30)
    upkeep.step()
    there.status = 200
    clock.on(5)
    upkeep.step()
    assert len(ends(there)) == 6, "what did not arrive is repeated soon"
    with sessions.begin() as session:
        put(session, replace(alarm, sequence="updated", severity="note", has_ended=True, subject="Repaired"), clock())
    notifier.run_until_idle()
    assert ends(there)[-1] == clock.now
    clock.on(300)
    upkeep.step()
    assert len(ends(there)) == 7, "what is over is not repeated"


def beats(there: WebhookServer) -> int:
    return sum(one.path == "/ping/secret" for one in there.posted)


def alive(sessions: sessionmaker[Session], now: datetime, *rights: str) -> None:
    with sessions.begin() as session:
        session.execute(delete(Lease).where(Lease.name.in_((POLLING, WORKING))))
        for right in rights:
            process_leases.hold(session, right, "host:1", now, timedelta(seconds=60))


def test_the_heart_beats_while_poller_and_worker_live(
    sessions: sessionmaker[Session], building: int, there: WebhookServer, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    upkeep = Housekeeping(sessions, settings(there), clock, timer=clock.timer)
    for rights, expected in (((), 0), ((POLLING,), 0), ((WORKING,), 0), ((POLLING, WORKING), 1), ((WORKING,), 1)):
        alive(sessions, clock(), *rights)
        upkeep.step()
        assert beats(there) == expected, rights
        clock.on(60)
    alive(sessions, clock(), POLLING, WORKING)
    upkeep.step()
    clock.on(10)
    upkeep.step()
    assert beats(there) == 2, "not more often than asked for"
    clock.on(60.1)
    upkeep.step()
    assert beats(there) == 2, "the leases have lapsed"
    assert "no worker was seen lately" in caplog.text
    assert "secret" not in caplog.text


def test_no_heart_beats_while_work_is_stuck(
    sessions: sessionmaker[Session], building: int, there: WebhookServer
) -> None:
    alive(sessions, NOW, POLLING, WORKING)
    with sessions.begin() as session:
        session.add(
            Alert(
                building_id=building,
                cause="worker",
                kind="data",
                state="active",
                began_at=NOW,
                event_ids=[],
                channels=[],
                evidence={},
                summary="Records wait",
                sentences=[],
                opened_at=NOW,
                updated_at=NOW,
            )
        )
    Housekeeping(sessions, settings(there), Clock()).step()
    assert beats(there) == 0


def test_one_of_two_notifiers_does_it(sessions: sessionmaker[Session], building: int, there: WebhookServer) -> None:
    alive(sessions, NOW, POLLING, WORKING)
    first, second = (Housekeeping(sessions, settings(there), Clock(), holder) for holder in ("a", "b"))
    first.step()
    second.step()
    assert beats(there) == 1
    first.end()
    Housekeeping(sessions, settings(there), Clock(), "b").step()
    assert beats(there) == 2
