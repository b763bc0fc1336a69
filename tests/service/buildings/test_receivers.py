"""Receivers: what the file says, what people add, and that no secret is ever shown again."""

import base64
from datetime import UTC, datetime
from pathlib import Path

import pytest
from building_files import FOLDER, SMALL
from hypothesis import given, strategies as st
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import recipients, store as building_store
from service.buildings.description import BuildingFileError, read
from service.buildings.recipient_rules import ReceiverRule, shown_address, wrong_address, wrong_secret
from service.buildings.tables import Building
from service.errors import ConflictError, NotFoundError
from service.notify.outbox import MessageContent, put
from service.notify.tables import Delivery, Message, Receiver

NOW = datetime(2024, 1, 1, tzinfo=UTC)
LATER = datetime(2024, 1, 2, tzinfo=UTC)
KEY = "whsec_" + base64.b64encode(bytes(range(32))).decode()
MANAGER = '\n[[receiver]]\nname = "manager"\nkind = "email"\naddress = "manager@example.org"\n'
PROGRAM = f"""
[[receiver]]
name = "program"
kind = "webhook"
address = "https://example.org/hook/token-of-ours"
secret = "{KEY}"
kinds = ["alert"]
severities = ["warning", "alarm"]
"""


def rule(**other: object) -> ReceiverRule:
    given = {
        "name": "added",
        "kind": "email",
        "address": "added@example.org",
        "secret": None,
        "kinds": ("event",),
        "severities": ("alarm",),
    }
    return ReceiverRule(**(given | other))  # type: ignore[arg-type]


def names(session: Session, building: Building) -> list[str]:
    return [receiver.name for receiver in recipients.of_building(session, building.id)]


def test_reads_what_each_needs_to_hear_of() -> None:
    manager, program = read(SMALL + MANAGER + PROGRAM, FOLDER).receivers
    assert manager.kinds == ("event", "alert", "data", "drill")
    assert (manager.report, read(SMALL + MANAGER + "report = true\n", FOLDER).receivers[0].report) == (False, True)
    assert (manager.language, read(SMALL + MANAGER + 'language = "ja"\n', FOLDER).receivers[0].language) == ("en", "ja")
    assert read(SMALL + PROGRAM + 'language = "en"\n', FOLDER).receivers[0].language == "en"
    assert (program.kinds, program.severities) == (("alert",), ("warning", "alarm"))
    text = SMALL + MANAGER.replace('"email"', '"alertmanager"').replace("manager@example.org", "https://example.org")
    assert read(text, FOLDER).receivers[0].kinds == ("alert", "data", "drill")


WRONG = {
    "unknown language": (SMALL + MANAGER + 'language = "fr"\n', "receiver[1].language: input should be 'en' or 'ja'"),
    "language of a program": (
        SMALL + PROGRAM + 'language = "ja"\n',
        "receiver[1].language: programs get messages in Engl",
    ),
    "report of a program": (SMALL + PROGRAM + "report = true\n", "receiver[1].report: only mail carries a report"),
    "twice": (SMALL + MANAGER + MANAGER, "receiver[2].name: 'manager' is already used by receiver[1]"),
    "unknown kind": (SMALL + MANAGER.replace('"email"', '"pigeon"'), "receiver[1].kind"),
    "no mail address": (
        SMALL + MANAGER.replace("manager@", "manager at "),
        "receiver[1].address: give one mail address",
    ),
    "no web address": (
        SMALL + PROGRAM.replace("https://", "ftp://"),
        "receiver[1].address: give an address such as https",
    ),
    "unsigned": (SMALL + PROGRAM.replace("secret", "# secret"), "receiver[1]: a webhook is signed"),
    "a weak key": (SMALL + PROGRAM.replace(KEY, "whsec_c2hvcnQ="), "receiver[1].secret: must be whsec_"),
    "no variable": (SMALL + PROGRAM.replace(KEY, "env:1 2"), "receiver[1].secret: must name a variable"),
    "signed mail": (SMALL + MANAGER + f'secret = "{KEY}"\n', "receiver[1].secret: only a webhook is signed"),
    "not an array": (SMALL + PROGRAM.replace("[[receiver]]", "[receiver]"), "receiver: input should be a valid list"),
}


@pytest.mark.parametrize("name", WRONG)
def test_says_what_is_wrong_and_repeats_no_secret(name: str) -> None:
    text, message = WRONG[name]
    with pytest.raises(BuildingFileError) as caught:
        read(text, FOLDER)
    assert message in str(caught.value)
    assert KEY not in str(caught.value)
    assert "token-of-ours" not in str(caught.value)


def test_receivers_follow_the_file(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = building_store.add(session, SMALL + MANAGER + PROGRAM, Path("/"), NOW)
        assert names(session, building) == ["manager", "program"]
        put(session, MessageContent("event/1", building.id, "event", "new", "alarm", "Earthquake", ()), NOW)
        building_store.update_description(session, SMALL + PROGRAM.replace("alert", "event"), Path("/"), LATER)
        assert names(session, building) == ["program"]
        assert recipients.of_building(session, building.id)[0].kinds == ["event"]
        states = select(Receiver.name, Delivery.state).join(Delivery)
        assert session.execute(states).all() == [("manager", "dropped")]
        building_store.update_description(session, SMALL + MANAGER, Path("/"), LATER)
        assert names(session, building) == ["manager"], "the same row is there again, with its log"
        assert len(session.scalars(select(Receiver)).all()) == 2
        assert len(session.scalars(select(Message)).all()) == 1


def test_people_add_change_and_remove_their_own(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = building_store.add(session, SMALL + MANAGER, Path("/"), NOW)
        added = recipients.add(session, building.id, rule(), "engineer", NOW)
        assert (added.origin, added.created_by) == ("api", "engineer")
        with pytest.raises(ConflictError, match="already"):
            recipients.add(session, building.id, rule(), "engineer", NOW)
        recipients.change(added, rule(address="other@example.org"), NOW)
        assert recipients.receiver(session, added.id).address == "other@example.org"
        building_store.update_description(session, SMALL + MANAGER + PROGRAM, Path("/"), LATER)
        assert names(session, building) == ["manager", "added", "program"], "the file's own are all that follow it"
        recipients.remove_added(session, added, LATER)
        with pytest.raises(NotFoundError):
            recipients.receiver(session, added.id)
        of_file = recipients.of_building(session, building.id)[0]
        with pytest.raises(ConflictError, match="in the building file"):
            recipients.remove_added(session, of_file, LATER)
        with pytest.raises(ConflictError, match="in the building file"):
            recipients.change(of_file, rule(), NOW)


def test_the_api_cannot_read_our_environment(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = building_store.add(session, SMALL, Path("/"), NOW)
        for other in ({"address": "env:HOME"}, {"kind": "webhook", "address": "https://a.b/", "secret": "env:HOME"}):
            with pytest.raises(ConflictError, match="only the building file"):
                recipients.add(session, building.id, rule(**other), "engineer", NOW)


def test_a_shown_file_holds_no_secret() -> None:
    text = SMALL + MANAGER + PROGRAM
    shown = recipients.without_secrets(text, read(text, FOLDER).receivers)
    assert KEY not in shown
    assert "token-of-ours" not in shown
    assert shown.replace('"…"', f'"{KEY}"').replace("org/…", "org/hook/token-of-ours") == text, "nothing else changed"


@pytest.mark.parametrize(
    ("kind", "address", "shown"),
    [
        ("email", "manager@example.org", "manager@example.org"),
        ("webhook", "https://user:password@example.org:8443/hook/token?key=1", "https://example.org:8443/…"),
        ("webhook", "https://[2001:db8::1]/", "https://[2001:db8::1]/"),
        ("apprise", "slack://one/two/three", "slack://…"),
        ("webhook", "env:TOWER_HOOK", "env:TOWER_HOOK"),
    ],
)
def test_what_is_shown_of_an_address(kind: str, address: str, shown: str) -> None:
    assert shown_address(kind, address) == shown


@given(kind=st.sampled_from(["email", "webhook", "alertmanager", "apprise"]), text=st.text())
def test_any_text_is_right_or_stated_to_be_wrong(kind: str, text: str) -> None:
    for found in (wrong_address(kind, text), wrong_secret(kind, text)):
        assert found is None or found
    if wrong_address(kind, text) is None:
        assert shown_address(kind, text)
        assert "\n" not in text
