"""Recipients added after an alert was reported receive it once; messages without recipients state the reason."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from html import unescape
from pathlib import Path

import pytest
from alert_candidates import DAY, START, gain_error, softer_isolators
from alert_fixtures import building, earthquake, raise_softening, with_stored_events
from api_client import client
from fastapi.testclient import TestClient
from receivers import MailServer, mail_server
from sqlalchemy import update
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions
from service.alerts.messages import write_messages
from service.alerts.periodic_checks import check_buildings
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.jobs.queue import WATCH
from service.jobs.tables import Job
from service.notify.notifier import Notifier
from service.settings import Settings

AGE = timedelta(days=1)
MANAGER = {"name": "manager", "kind": "email", "address": "manager@example.org"}


@dataclass(slots=True)
class Stage:
    """A building that lost stiffness in 2024, reported to no one; its pages, its poller and its notifier."""

    sessions: sessionmaker[Session]
    api: TestClient
    box: MailServer
    settings: Settings
    code: str

    def goes_on(self) -> list[str]:
        """Subjects of the mails that have come, after two rounds of the poller and the notifier."""
        for _ in range(2):
            check_buildings(self.sessions, self.settings, datetime.now(UTC))
            Notifier(self.sessions, self.settings).run_until_idle()
        return [str(mail["Subject"]) for mail in self.box.mails]

    def add(self, **differently: object) -> int:
        made = self.api.post(f"/api/v1/buildings/{self.code}/receivers", json=MANAGER | differently)
        assert made.status_code == 201, made.text
        return int(made.json()["id"])

    def text(self, number: int) -> str:
        """Text of a mail, in one line."""
        part = self.box.mails[number].get_body(("plain",))
        assert part is not None
        return " ".join(part.get_content().split())


@pytest.fixture
def stage(sessions: sessionmaker[Session], database_url: str) -> Iterator[Stage]:
    with sessions.begin() as session:
        of = building(session)
        raise_softening(session, of)
        write_messages(session, of.id, AGE, START + 3 * DAY)
        code = of.code
    with client(database_url, smtp_host="localhost") as api, mail_server() as box:
        settings = Settings(
            disk_reserve=0,
            reminder_interval=0,
            inside_allowed=("localhost",),
            smtp_host="localhost",
            smtp_port=box.port,
            smtp_security="none",
        )
        yield Stage(sessions, api, box, settings, code)


def test_a_message_without_recipient_is_stored_and_listed_with_the_reason(stage: Stage) -> None:
    alert = stage.api.get("/api/v1/alerts").json()["items"][0]["id"]
    assert "Not sent: no recipients" in stage.api.get(f"/alerts/{alert}").text
    (reported,) = stage.api.get(f"/api/v1/alerts/{alert}").json()["messages"]
    assert (reported["receiver"], reported["unsent"]) == (None, "no recipients")
    page = unescape(stage.api.get(f"/buildings/{stage.code}/messages").text)
    assert "8 % softer in direction x</a>" in page
    assert "Not sent: no recipients" in page
    (row,) = stage.api.get(f"/api/v1/buildings/{stage.code}/messages").json()["items"]
    assert (row["receivers"], row["unsent"]) == (0, "no recipients")
    assert "Not sent: no recipients." in stage.api.get(f"/messages/{row['id']}").text
    stage.add(kinds=["drill"])
    with stage.sessions.begin() as session:
        of = session.query(Building).one()
        late = earthquake(session, of, START + 9 * DAY)
        write_messages(session, of.id, AGE, late.end)
    page = stage.api.get(f"/buildings/{stage.code}/messages").text
    assert "Not sent: no recipient is subscribed to messages of this kind and severity" in page


def test_a_new_recipient_hears_once_of_what_is_open_and_then_what_becomes_of_it(stage: Stage) -> None:
    assert stage.goes_on() == []
    (alert,) = stage.api.get("/api/v1/alerts?state=active").json()["items"]
    taken = {"note": "on my way", "name": "Jo"}
    assert stage.api.post(f"/api/v1/alerts/{alert['id']}/acknowledge", json=taken).status_code == 200
    stage.add()
    (subject,) = stage.goes_on()
    assert subject.startswith("OPEN SINCE 2024-01-04: [the paper's building] Earthquake of 3 January 2024")
    assert subject.endswith("The isolators are 8 % softer in direction x")
    words = stage.text(0)
    assert "You became a recipient on" in words
    assert "This was written before that, on 2024-01-04" in words
    assert f"Alert {alert['id']} is acknowledged by Jo (loopback) since" in words
    page = stage.api.get(f"/buildings/{stage.code}/messages").text
    assert "delivered" in page
    ended = {"outcome": "confirmed", "note": "bearings replaced"}
    assert stage.api.post(f"/api/v1/alerts/{alert['id']}/inspect", json=ended).status_code == 200
    with stage.sessions.begin() as session:  # what is watched was computed again, and showed nothing new
        session.execute(update(Job).where(Job.kind == WATCH).values(state="done", finished_at=datetime.now(UTC)))
    subjects = stage.goes_on()
    assert len(subjects) == 2
    assert subjects[1].startswith("UPDATED: ")
    assert "You became a recipient" not in stage.text(1)
    stage.add(name="late", address="late@example.org")
    assert len(stage.goes_on()) == 2, "what has ended is not sent"


def test_a_recipient_whose_rule_or_address_changes_hears_of_what_it_now_should(stage: Stage) -> None:
    """A rule without alarms, then one with alarms; another address, then the same rule again."""
    number = stage.add(severities=["note"])
    assert stage.goes_on() == []
    for wanted, count in (
        ({"severities": ["alarm"]}, 1),
        ({"severities": ["alarm", "note"]}, 1),
        ({"address": "successor@example.org"}, 2),
        ({"kinds": ["alert", "event"]}, 2),
    ):
        assert stage.api.patch(f"/api/v1/receivers/{number}", json=wanted).status_code == 200
        assert len(stage.goes_on()) == count, wanted
    assert stage.box.mails[1]["To"] == "successor@example.org"
    assert stage.box.mails[1]["Menshin-Repeat"] == "false"


def test_a_recipient_of_the_building_file_hears_with_the_next_round(stage: Stage) -> None:
    with stage.sessions.begin() as session:
        of = session.query(Building).one()
        more = '\n[[receiver]]\nname = "office"\nkind = "email"\naddress = "office@example.org"\n'
        building_store.update_description(
            session, f"{building_store.current(session, of).toml}{more}", Path("/"), datetime.now(UTC)
        )
    assert len(stage.goes_on()) == 1


def test_what_is_silenced_is_sent_when_the_silence_ends(stage: Stage) -> None:
    with stage.sessions.begin() as session:
        of, now = session.query(Building).one(), datetime.now(UTC)
        operator_actions.silence(session, of, "*", now + DAY, "a load test", "Jo", now)
    stage.add(severities=["alarm"])
    assert stage.goes_on() == []
    assert stage.api.post("/silences/1/end").status_code == 303
    assert len(stage.goes_on()) == 1


def test_what_is_on_hold_is_sent_as_that(stage: Stage) -> None:
    with stage.sessions.begin() as session:
        of = session.query(Building).one()
        events = session.query(Alert).one().event_ids
        found = [with_stored_events(one, tuple(events)) for one in (softer_isolators(), gain_error())]
        reconcile(session, of.id, found, "events", datetime.now(UTC))
    assert stage.goes_on() == []
    stage.add()
    assert len(stage.goes_on()) == 2, "the sensor was reported with another earthquake"
    words = next(stage.text(n) for n in range(2) if "is faulty" in stage.text(n))
    assert "Alert 1 is on hold." in words
