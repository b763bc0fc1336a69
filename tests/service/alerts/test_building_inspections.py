"""Inspections of buildings: what falls by them, what does not, and that nothing is erased."""

import getpass
from datetime import UTC, datetime
from html import unescape

import pytest
from alert_candidates import softer_isolators
from alert_fixtures import SOON, with_stored_events
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, day, earthquake
from sqlalchemy import update
from sqlalchemy.orm import Session, sessionmaker
from typer.testing import CliRunner

from service.access.roles import Caller, Role
from service.access.tables import AuditEntry
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.cli import app
from service.drift.alert_candidates import limit_candidates
from service.jobs.tables import Job
from service.verdict.tables import BuildingLevel

pytestmark = pytest.mark.sqlite

FIT = {"result": "fit", "comment": "24 bearings seen", "name": "Jo"}


@pytest.fixture
def code(sessions: sessionmaker[Session]) -> str:
    """A building whose inspection limit an earthquake of day 1 exceeded."""
    with sessions.begin() as session:
        of = building(session)
        add_comparison(session, earthquake(session, of, day(1), STRONG))
        reconcile(session, of.id, limit_candidates(session, of.id), "events", day(1) + SOON)
        return of.code


def compare(sessions: sessionmaker[Session]) -> None:
    """Finish the comparison with earlier earthquakes that the end of an alert starts."""
    with sessions.begin() as session:
        session.execute(update(Job).values(state="done"))


def test_an_inspection_after_the_earthquake_ends_what_its_limits_led_to(
    database_url: str, sessions: sessionmaker[Session], code: str
) -> None:
    at = day(2).isoformat()
    with client(database_url) as asking:
        api = f"/api/v1/buildings/{code}"
        assert asking.get(f"{api}/verdict").json()["level"] == "inspect"
        made = asking.post(f"{api}/inspections", json={**FIT, "inspected_at": at})
        assert made.status_code == 201
        again = asking.post(f"{api}/inspections", json={**FIT, "inspected_at": at})
        assert again.json() == made.json()
        assert asking.get(f"{api}/verdict").json()["is_provisional"]
        compare(sessions)
        verdict = asking.get(f"{api}/verdict").json()
        page = unescape(asking.get(f"/buildings/{code}").text)
        event = asking.get("/api/v1/events/2/verdict").json()
        listed = asking.get(f"{api}/inspections").json()["items"]
    assert (verdict["level"], verdict["automatic_level"], verdict["open_alerts"]) == ("watch", "inspect", [])
    assert [one["outcome"] for one in verdict["checks"]].count("exceeded") >= 2
    assert verdict["inspection"]["by"] == "Jo (loopback)"
    words = "Inspected by Jo (loopback) on 2024-01-03 00:00 UTC: fit for normal use. The automatic result was inspect"
    assert words in " ".join(verdict["sentences"])
    assert words in page
    assert "24 bearings seen" in page
    assert event["level"] == "inspect", "the record of the earthquake stays"
    assert [(one["level"], one["result"]) for one in listed] == [("inspect", "fit")]
    with sessions() as session:
        alert = session.query(Alert).one()
        assert (alert.state, alert.inspections[0].by) == ("resolved", "Jo (loopback)")
        assert session.query(BuildingLevel).one().level == "undecided"  # as it was when the inspection was recorded
        assert session.query(AuditEntry).one().target == f"/api/v1/buildings/{code}/inspections"


def test_an_inspection_before_the_earthquake_does_not_cover_it(
    database_url: str, sessions: sessionmaker[Session], code: str
) -> None:
    with client(database_url) as asking:
        api = f"/api/v1/buildings/{code}"
        early = asking.post(f"{api}/inspections", json={**FIT, "inspected_at": day(1).isoformat()})
        assert early.status_code == 201
        verdict = asking.get(f"{api}/verdict").json()
        assert (verdict["level"], verdict["inspection"]["covers"]) == ("inspect", False)
        assert "does not cover it" in " ".join(verdict["sentences"])
        assert [one["cause"] for one in verdict["open_alerts"]] == ["limits"]
        late = asking.post(f"{api}/inspections", json={**FIT, "inspected_at": "2190-01-01T00:00:00Z"})
        assert late.status_code == 409
        assert asking.post(f"{api}/inspections", json=FIT).status_code == 201
        compare(sessions)
        assert asking.get(f"{api}/verdict").json()["level"] == "watch"
    with sessions.begin() as session:
        later = earthquake(session, session.query(Alert).one().building, datetime.now(UTC), STRONG)
        add_comparison(session, later)
    with client(database_url) as asking:
        assert asking.get(f"/api/v1/buildings/{code}/verdict").json()["level"] == "inspect"


def test_what_is_graver_than_known_and_other_alerts_do_not_fall(
    database_url: str, sessions: sessionmaker[Session], code: str
) -> None:
    with sessions.begin() as session:
        of = session.query(Alert).one().building
        events = tuple(earthquake(session, of, day(number)).id for number in (2, 3, 4))
        lost = with_stored_events(softer_isolators(25.0), events)
        reconcile(session, of.id, [*limit_candidates(session, of.id), lost], "events", day(4) + SOON)
    with client(database_url) as asking:
        api = f"/api/v1/buildings/{code}"
        asking.post(f"{api}/inspections", json={**FIT, "inspected_at": day(5).isoformat()})
        verdict = asking.get(f"{api}/verdict").json()
    assert [one["kind"] for one in verdict["open_alerts"]] == ["deterioration"]
    assert verdict["level"] == verdict["open_alerts"][0]["level"]


@pytest.mark.parametrize(("result", "level"), [("restricted", "inspect"), ("unfit", "act")])
def test_a_restriction_stays_over_later_earthquakes_until_the_next_inspection(
    database_url: str, sessions: sessionmaker[Session], result: str, level: str
) -> None:
    with sessions.begin() as session:
        of = building(session)
        add_comparison(session, earthquake(session, of, day(1)))
        code = of.code
    with client(database_url) as asking:
        api = f"/api/v1/buildings/{code}"
        assert asking.get(f"{api}/verdict").json()["level"] == "normal"
        restricted = {"result": result, "comment": "east stairs closed", "inspected_at": day(2).isoformat()}
        asking.post(f"{api}/inspections", json=restricted)
        with sessions.begin() as session:
            add_comparison(session, earthquake(session, session.get_one(type(of), of.id), day(3)))
        verdict = asking.get(f"{api}/verdict").json()
        assert (verdict["level"], verdict["automatic_level"]) == (level, "normal")
        asking.post(f"{api}/inspections", json={**FIT, "inspected_at": day(4).isoformat()})
        assert asking.get(f"{api}/verdict").json()["level"] == "normal"


def test_the_command_signs_with_the_account(
    database_url: str, monkeypatch: pytest.MonkeyPatch, sessions: sessionmaker[Session], code: str
) -> None:
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    inspect = ["building", "inspect", code, "--comment", "seen", "--name", "Jo", "--at", day(2).isoformat()]
    assert CliRunner().invoke(app, [*inspect, "--result", "safe"]).exit_code == 2
    done = CliRunner().invoke(app, [*inspect, "--result", "fit"])
    assert done.exit_code == 0, done.output
    assert f"Inspected by Jo ({getpass.getuser()})" in done.stdout
    assert "fit for normal use" in done.stdout
    with sessions() as session:
        assert session.query(Alert).one().state == "resolved"
        assert session.query(AuditEntry).one().action == "menshin building inspect"


def test_the_form_takes_the_buildings_time_and_a_viewer_cannot_sign(database_url: str, code: str) -> None:
    form = {"result": "fit", "comment": "<b>seen</b>", "inspected_at": "2024-01-03T09:00"}
    with client(database_url, visitor=Caller("guest", Role.viewer)) as asking:
        assert asking.post(f"/buildings/{code}/inspections", data=form).status_code == 403
        assert "Record an inspection" not in asking.get(f"/buildings/{code}").text
    with client(database_url) as asking:
        for wrong in ({"result": "safe"}, {"comment": ""}, {"inspected_at": "0001-01-01T00:00"}, {"inspected_at": "x"}):
            refused = asking.post(f"/buildings/{code}/inspections", data={**form, **wrong})
            assert refused.status_code in (409, 422), wrong
            assert "Not accepted." in refused.text
        assert asking.post(f"/buildings/{code}/inspections", data=form).status_code == 303
        page = asking.get(f"/buildings/{code}").text
        (one,) = asking.get(f"/api/v1/buildings/{code}/inspections").json()["items"]
    assert one["inspected_at"] == "2024-01-03T00:00:00Z"  # the building is in Tokyo
    assert "&lt;b&gt;seen&lt;/b&gt;" in page
