"""A notifier that is killed at any moment loses no message, and sends none twice without saying so."""

import os
import signal
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic, sleep

import psutil
import pytest
from building_files import SMALL
from processes import interrupt, running_command
from receivers import MailServer, WebhookServer, mail_server, webhook_server
from rendered_messages import KEY
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker
from standardwebhooks import Webhook

from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.notify.outbox import MessageContent, put
from service.notify.tables import Delivery, DeliveryAttempt, Message

MESSAGES = 16
KILLS = 3

pytestmark = pytest.mark.slow


def until(met: Callable[[], bool], seconds: float = 60) -> None:
    end = monotonic() + seconds
    while not met():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.005)


def prepared(sessions: sessionmaker[Session], program: WebhookServer, count: int) -> None:
    """A building with a mail address and a program as recipients, and as many messages."""
    now = datetime.now(UTC)
    rules = (
        ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES),
        ReceiverRule("program", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES),
    )
    with sessions.begin() as session:
        building = building_store.add(session, SMALL, Path("/"), now)
        for rule in rules:
            recipients.add(session, building.id, rule, "engineer", now)
        for number in range(count):
            one = MessageContent(f"event/{number}", building.id, "event", "new", "note", f"Number {number}", ("Said.",))
            put(session, one, now)


@contextmanager
def notifying(folder: Path, url: str, box: MailServer) -> Iterator[psutil.Popen]:
    """The real command."""
    settings = {
        "MENSHIN_NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost"]',
        "MENSHIN_NOTIFY__ALLOW_PLAIN_HTTP": "true",
        "MENSHIN_SMTP__HOST": "localhost",
        "MENSHIN_SMTP__PORT": str(box.port),
        "MENSHIN_SMTP__SECURITY": "none",
        "MENSHIN_NOTIFY__RETRY_DELAY": "0.2",
    }
    with running_command(folder, url, "notify", **settings) as process:
        yield process


def let_leases_lapse(sessions: sessionmaker[Session]) -> None:
    """As if the dead one's time had passed."""
    past = datetime.now(UTC) - timedelta(seconds=1)
    with sessions.begin() as session:
        session.execute(update(Delivery).where(Delivery.state == "sending").values(claimed_until=past))


def all_delivered(sessions: sessionmaker[Session]) -> bool:
    with sessions() as session:
        return set(session.scalars(select(Delivery.state))) == {"delivered"}


def assert_told(sessions: sessionmaker[Session], program: WebhookServer, box: MailServer, count: int) -> int:
    """Everybody got everything; of those that came twice each but the first says so. The number of repeats."""
    with sessions() as session:
        identities = set(session.scalars(select(Message.identity)))
    posted, mailed = defaultdict(list), defaultdict(list)
    for one in program.posted:
        assert Webhook(KEY).verify(one.body, dict(one.headers))["id"] == one.headers["webhook-id"]
        posted[one.headers["webhook-id"]].append(one.headers["menshin-repeat"] == "true")
    for mail in box.mails:
        mailed[mail["Message-ID"].strip("<>").partition("@")[0]].append(mail["Subject"].startswith("(repeat) "))
    assert set(posted) == set(mailed) == identities
    assert len(identities) == count
    for received in (*posted.values(), *mailed.values()):
        assert all(received[1:]), "came again and did not say so"
    return sum(len(received) - 1 for received in (*posted.values(), *mailed.values()))


def test_killed_between_what_is_sent_and_what_is_written(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    """The worst moment, hit for certain: the receiver has it, and the notifier dies before it hears so."""
    with webhook_server() as program, mail_server() as box:
        prepared(sessions, program, 1)
        with notifying(tmp_path, database_url, box) as notifier:
            killed = []

            def kill() -> None:
                if not killed:
                    killed.append(notifier.pid)
                    os.kill(notifier.pid, signal.SIGKILL)

            program.meanwhile = box.meanwhile = kill
            assert notifier.wait(60) == -signal.SIGKILL
        assert len(program.posted) + len(box.raw) >= 1
        let_leases_lapse(sessions)
        with notifying(tmp_path, database_url, box) as notifier:
            until(lambda: all_delivered(sessions))
            assert interrupt(notifier) == 0
        assert assert_told(sessions, program, box, 1) >= 1, "the kill hit nothing"
        with sessions() as session:
            outcomes = set(session.scalars(select(DeliveryAttempt.outcome)))
        assert outcomes == {"unknown", "delivered"}


def test_killed_at_any_moment(sessions: sessionmaker[Session], database_url: str, tmp_path: Path) -> None:
    with webhook_server() as program, mail_server() as box:
        prepared(sessions, program, MESSAGES)
        program.meanwhile = lambda: sleep(0.03)
        for kill in range(KILLS):
            before = len(program.posted) + len(box.raw)
            with notifying(tmp_path, database_url, box) as notifier:
                until(lambda b=before: len(program.posted) + len(box.raw) > b or all_delivered(sessions))
                sleep(0.011 * kill)
                notifier.kill()
                notifier.wait()
            let_leases_lapse(sessions)
        with notifying(tmp_path, database_url, box) as notifier:
            until(lambda: all_delivered(sessions))
            assert interrupt(notifier) == 0
        assert_told(sessions, program, box, MESSAGES)
