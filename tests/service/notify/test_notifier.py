"""The notifier: what arrives, what is tried again and how late, what is given up, and in which order."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from random import Random
from threading import Event, Thread
from time import monotonic, sleep

import databases
import pytest
from at_once import interleave
from building_files import SMALL
from hypothesis import given, strategies as st
from receivers import MailServer, WebhookServer, mail_server, webhook_server
from rendered_messages import KEY
from sqlalchemy import event, select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker
from standardwebhooks import Webhook

from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.notify import claims
from service.notify.channels import DeliveryResult
from service.notify.claims import Claim, RetryPolicy
from service.notify.notifier import Notifier
from service.notify.outbox import MessageContent, put
from service.notify.tables import Delivery, DeliveryAttempt
from service.settings import Settings

NOW = datetime(2024, 1, 1, tzinfo=UTC)
LEASE = timedelta(seconds=30)
PATIENCE = RetryPolicy(attempts=3, delay=timedelta(seconds=10), longest=timedelta(seconds=60))


@dataclass(slots=True)
class Clock:
    """A clock that stands until it is moved."""

    now: datetime = NOW

    def __call__(self) -> datetime:
        return self.now

    def on(self, seconds: float) -> None:
        self.now += timedelta(seconds=seconds)


@dataclass(slots=True)
class Stage:
    """A building, its notifier, and its recipients."""

    sessions: sessionmaker[Session]
    building: int
    program: WebhookServer
    box: MailServer
    clock: Clock = field(default_factory=Clock)

    @property
    def notifier(self) -> Notifier:
        settings = Settings(
            inside_allowed=("localhost",),
            plain_http_allowed=True,
            smtp_host="localhost",
            smtp_port=self.box.port,
            smtp_security="none",
            notice_attempts=3,
            notice_delay=10,
            public_url="https://menshin.example.org/",
        )
        return Notifier(self.sessions, settings, self.clock, Random(1))

    def add_recipient(self, kind: str, address: str) -> None:
        secret = KEY if kind == "webhook" else None
        rule = ReceiverRule(kind, kind, address, secret, WANTED_KINDS, SEVERITIES)  # type: ignore[arg-type]
        with self.sessions.begin() as session:
            recipients.add(session, self.building, rule, "engineer", NOW)

    def put(self, printed: str, sequence: str = "new", key: str = "event/1", severity: str = "note") -> None:
        one = MessageContent(key, self.building, "event", sequence, severity, printed, (printed,), link="/events/1")  # type: ignore[arg-type]
        with self.sessions.begin() as session:
            put(session, one, self.clock())

    def states(self) -> list[str]:
        with self.sessions() as session:
            return list(session.scalars(select(Delivery.state).order_by(Delivery.id)))

    def attempts(self) -> list[DeliveryAttempt]:
        with self.sessions() as session:
            return list(session.scalars(select(DeliveryAttempt).order_by(DeliveryAttempt.id)))

    def received(self) -> list[tuple[str, bool]]:
        """Subjects as the webhook got them, and whether as a repeat."""
        return [(one["subject"], one["repeat"]) for one in (json.loads(p.body)["data"] for p in self.program.posted)]


@pytest.fixture
def stage(sessions: sessionmaker[Session]) -> Iterator[Stage]:
    with sessions.begin() as session:
        building = building_store.add(session, SMALL, Path("/"), NOW).id
    with webhook_server() as program, mail_server() as box:
        yield Stage(sessions, building, program, box)


def test_messages_go_out_in_the_order_of_their_severity(stage: Stage) -> None:
    stage.add_recipient("webhook", stage.program.address + "/hook")
    for number, severity in enumerate(("normal", "note", "alarm", "warning", "alarm")):
        stage.put(f"{number} {severity}", key=f"event/{number}", severity=severity)
        stage.clock.on(1)
    stage.notifier.run_until_idle()
    assert [one for one, _ in stage.received()] == ["2 alarm", "4 alarm", "3 warning", "1 note", "0 normal"]


def test_every_receiver_gets_it_and_every_attempt_is_kept(stage: Stage) -> None:
    stage.add_recipient("webhook", stage.program.address + "/hook")
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    assert stage.notifier.run_until_idle() == 2
    assert stage.states() == ["delivered", "delivered"]
    assert [mail["Subject"] for mail in stage.box.mails] == ["[a tower] Earthquake"]
    assert stage.received() == [("Earthquake", False)]
    assert json.loads(stage.program.posted[0].body)["data"]["link"] == "https://menshin.example.org/events/1"
    first, second = stage.attempts()
    assert (first.outcome, first.answer, first.is_repeat) == ("delivered", "204", False)
    assert first.address == stage.program.address + "/…"
    assert second.address == "manager@example.org"
    assert first.seconds is not None
    assert 0 < first.seconds < 30


def test_what_is_not_taken_is_tried_ever_later_and_then_given_up(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.box.refuses["manager@example.org"] = "451 come back later"
    stage.put("Earthquake")
    notifier = stage.notifier
    waits = []
    for _ in range(2):
        assert notifier.run_until_idle() == 1
        with stage.sessions() as session:
            due = session.scalars(select(Delivery.due_at)).one()
        waits.append((due - stage.clock.now).total_seconds())
        stage.clock.on(waits[-1] - 0.001)
        assert notifier.run_until_idle() == 0, "it is not due yet"
        stage.clock.on(0.001)
    assert 5 <= waits[0] <= 10 <= waits[1] <= 20
    assert notifier.run_until_idle() == 1
    assert stage.states() == ["failed"]
    assert {one.answer for one in stage.attempts()} == {"451 come back later"}
    assert not any(one.is_repeat for one in stage.attempts()), "nothing was ever taken"


def test_what_is_refused_for_good_is_not_tried_again(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.box.refuses["manager@example.org"] = "550 no such mailbox"
    stage.put("Earthquake")
    stage.notifier.run_until_idle()
    assert stage.states() == ["failed"]


def test_what_may_have_arrived_is_tried_again_as_a_repeat(stage: Stage) -> None:
    stage.add_recipient("webhook", stage.program.address)
    stage.program.status = 503
    stage.put("Earthquake")
    notifier = stage.notifier
    notifier.run_until_idle()
    stage.program.status = 204
    stage.clock.on(10)
    notifier.run_until_idle()
    assert stage.received() == [("Earthquake", False), ("Earthquake", True)]
    assert len({one.headers["webhook-id"] for one in stage.program.posted}) == 1
    assert [one.outcome for one in stage.attempts()] == ["unknown", "delivered"]


def test_news_of_one_thing_comes_in_its_order(stage: Stage) -> None:
    stage.add_recipient("webhook", stage.program.address)
    stage.program.status = 404
    stage.put("First")
    notifier = stage.notifier
    notifier.run_until_idle()
    stage.program.status = 204
    stage.put("Second", "updated")
    stage.put("Other", key="event/2")
    notifier.run_until_idle()
    assert [printed for printed, _ in stage.received()] == ["First", "Other"], "the second waits for the first"
    stage.clock.on(10)
    notifier.run_until_idle()
    assert [printed for printed, _ in stage.received()] == ["First", "Other", "First", "Second"]


def test_a_variable_that_is_missing_is_reported_as(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    table = '\n[[receiver]]\nname = "program"\nkind = "webhook"\naddress = "env:M_HOOK"\nsecret = "env:M_KEY"\n'
    with stage.sessions.begin() as session:
        building_store.update_description(session, SMALL + table, Path("/"), NOW)
    stage.put("Earthquake")
    notifier = stage.notifier
    notifier.run_until_idle()
    assert stage.attempts()[0].answer == "the environment has no M_KEY, which the building file names"
    monkeypatch.setenv("M_HOOK", stage.program.address)
    monkeypatch.setenv("M_KEY", KEY)
    stage.clock.on(10)
    notifier.run_until_idle()
    assert stage.states() == ["delivered"]
    posted = stage.program.posted[0]
    sent_at = datetime.fromtimestamp(int(posted.headers["webhook-timestamp"]), UTC)
    right = Webhook(KEY).sign(posted.headers["webhook-id"], sent_at, posted.body.decode())
    assert posted.headers["webhook-signature"] == right


def test_many_notifiers_at_once_send_nothing_twice(stage: Stage) -> None:
    stage.add_recipient("webhook", stage.program.address)
    for number in range(12):
        stage.put(f"Number {number}", key=f"event/{number}")
    stop = Event()
    threads = [Thread(target=stage.notifier.run, args=(stop,)) for _ in range(3)]
    for thread in threads:
        thread.start()
    end = monotonic() + 30
    while set(stage.states()) != {"delivered"}:
        assert monotonic() < end
        sleep(0.02)
    stop.set()
    for thread in threads:
        thread.join()
    assert sorted(stage.received()) == sorted((f"Number {number}", False) for number in range(12))


def claimed(stage: Stage, now: datetime) -> Claim | None:
    with stage.sessions.begin() as session:
        return claims.claim(session, now, LEASE, PATIENCE)


def finished(stage: Stage, held: Claim, answer: DeliveryResult, now: datetime) -> bool:
    with stage.sessions.begin() as session:
        return claims.finish(session, held, answer, 0.1, now, PATIENCE, Random(2))


def test_a_delivery_is_one_notifiers_until_its_lease_lapses(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    first = claimed(stage, NOW)
    assert first is not None
    assert not first.is_repeat
    assert claimed(stage, NOW + LEASE) is None
    second = claimed(stage, NOW + LEASE * 1.1)
    assert second is not None
    assert second.is_repeat, "the first one may have sent it"
    assert not finished(stage, first, DeliveryResult("delivered", "late"), NOW + LEASE * 1.2)
    assert stage.states() == ["sending"], "who lost the claim decides nothing"
    assert finished(stage, second, DeliveryResult("delivered", "taken"), NOW + LEASE * 1.3)
    assert stage.states() == ["delivered"]
    assert [one.answer for one in stage.attempts()] == ["late", "taken"], "but what it saw is kept"


@pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)
def test_a_late_result_beside_the_claim_of_another_notifier(stage: Stage) -> None:
    """Both write the delivery and its attempt; neither waits for the other."""
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    first = claimed(stage, NOW)
    assert first is not None
    later = NOW + LEASE * 1.1
    interleave(
        stage.sessions,
        lambda: finished(stage, first, DeliveryResult("delivered", "late"), later),
        "UPDATE delivery",
        lambda: claimed(stage, later),
    )
    assert stage.states() == ["delivered"]
    assert [one.answer for one in stage.attempts()] == ["late"]


@pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)
def test_a_database_that_goes_away_before_a_message_is_read_costs_no_attempt(stage: Stage, postgres: str) -> None:
    engine = stage.sessions.kw["bind"]
    stage.add_recipient("webhook", stage.program.address + "/hook")
    stage.put("Earthquake")
    notifier = stage.notifier

    def go_away(*_: object) -> None:
        databases.alter(postgres, engine.url, "ALLOW_CONNECTIONS false")

    event.listen(engine, "checkin", go_away, once=True)  # when the delivery has been claimed
    with pytest.raises(OperationalError, match="not currently accepting connections"):
        notifier.run_until_idle()
    databases.alter(postgres, engine.url, "ALLOW_CONNECTIONS true")
    assert stage.states() == ["sending"]
    assert notifier.run_until_idle() == 1
    assert stage.received() == [("Earthquake", False)]
    (attempt,) = stage.attempts()
    assert (attempt.outcome, attempt.is_repeat) == ("delivered", False)
    with stage.sessions() as session:
        assert session.scalars(select(Delivery.tries)).one() == 1


def test_who_is_removed_in_the_middle_of_an_attempt_gets_no_other(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    held = claimed(stage, NOW)
    assert held is not None
    with stage.sessions.begin() as session:
        recipients.remove_added(session, recipients.of_building(session, stage.building)[0], NOW)
    assert finished(stage, held, DeliveryResult("not_taken", "451 later"), NOW)
    assert claimed(stage, NOW + LEASE) is None
    assert stage.states() == ["dropped"]


def test_one_over_which_processes_die_is_given_up(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    now = NOW
    for _ in range(PATIENCE.attempts):
        assert claimed(stage, now) is not None
        now += LEASE * 1.1
    assert claimed(stage, now) is None
    assert stage.states() == ["failed"]
    assert [one.outcome for one in stage.attempts()] == ["unknown"] * 3


def test_a_process_that_dies_does_not_lengthen_the_pause(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    assert claimed(stage, NOW) is not None
    later = NOW + LEASE * 1.1
    second = claimed(stage, later)
    assert second is not None
    assert finished(stage, second, DeliveryResult("not_taken", "451 come back later"), later)
    with stage.sessions() as session:
        due = session.scalars(select(Delivery.due_at)).one()
    assert due - later <= PATIENCE.delay, "as after the first answer"


def test_processes_that_died_before_a_replay_do_not_shorten_the_pauses_after_it(stage: Stage) -> None:
    stage.add_recipient("email", "manager@example.org")
    stage.put("Earthquake")
    now = NOW
    while claimed(stage, now) is not None:
        now += LEASE * 1.1
    with stage.sessions.begin() as session:
        claims.replay(session.scalars(select(Delivery)).one(), now)
    for _ in range(2):
        held = claimed(stage, now)
        assert held is not None
        assert finished(stage, held, DeliveryResult("not_taken", "451 come back later"), now)
        with stage.sessions() as session:
            due = session.scalars(select(Delivery.due_at)).one()
        pause, now = due - now, due
    assert pause >= PATIENCE.delay, "as after the second answer"


@given(failures=st.integers(1, 10_000), seed=st.integers(0, 2**32))
def test_pauses_grow_to_the_longest_and_never_beyond(failures: int, seed: int) -> None:
    pause = PATIENCE.pause(failures, Random(seed))
    full = min(60.0, 10.0 * 2.0 ** min(failures - 1, 10))
    assert full / 2 <= pause.total_seconds() <= full
