"""Pages of alerts, and their forms."""

import re
from collections.abc import Iterator
from datetime import datetime, timedelta
from html import unescape
from pathlib import Path

import monitored_building
import pytest
import stored_histories
from alert_candidates import softer_isolators, stopped_data
from api_client import client
from fastapi.testclient import TestClient
from sqlalchemy import inspect, select
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import Role
from service.alerts.messages import write_messages
from service.alerts.pages import LISTED
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings.tables import Building
from service.records.tables import Event

pytestmark = pytest.mark.sqlite

AGE = timedelta(days=10_000)


def lost(session: Session) -> None:
    """The building of monitored_building.py lost stiffness with its second earthquake; its server is silent."""
    building = session.scalars(select(Building)).one()
    events = session.scalars(select(Event).where(Event.state == "analysed").order_by(Event.start)).all()
    found = softer_isolators(
        began_at=events[-2].start,
        raised_at=events[-1].start,
        onset_event_id=events[-2].id,
        raised_event_id=events[-1].id,
        event_ids=tuple(event.id for event in events[-2:]),
    )
    reconcile(session, building.id, [found], "events", monitored_building.NOW)
    reconcile(session, building.id, [stopped_data()], "clock", monitored_building.NOW)
    session.flush()
    write_messages(session, building.id, AGE, monitored_building.NOW)


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's browser."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records")
    with sessions.begin() as session:
        lost(session)
    with client(database_url) as made:
        yield made


def test_an_alert_is_seen_from_the_first_page_to_its_end(
    api: TestClient, database_url: str, sessions: sessionmaker[Session]
) -> None:
    first = api.get("/buildings/PAPER").text
    assert '<span class="badge">2 open</span>' in first
    assert '<a href="/alerts/1">The isolators are 8 % softer in direction x</a>' in first
    listed = api.get("/buildings/PAPER/alerts").text
    assert listed.index("The monitoring server") < listed.index("8 % softer")
    shown = api.get("/alerts/1").text
    for wanted in (
        "They carry the building",
        "/charts/restoring-force.svg",
        "Acknowledge it",
        "Not sent: no recipients",
    ):
        assert wanted in shown, wanted

    assert api.post("/alerts/1/acknowledge", data={"name": "Jo", "note": "on my way"}).status_code == 303
    assert "Jo (loopback), " in api.get("/alerts/1").text
    form = {"outcome": "confirmed", "note": "replaced", "reference": "from_now", "name": ""}
    assert api.post("/alerts/1/inspect", data=form).status_code == 303
    ended = api.get("/alerts/1").text
    assert "End it" not in ended
    assert "later earthquakes are compared with a new reference period" in ended
    assert '<span class="badge">1 open</span>' in api.get("/").text

    silence = {"pattern": "source", "hours": "4", "reason": "<b>maintenance</b>"}
    assert api.post("/buildings/PAPER/silences", data=silence).status_code == 303
    listed = api.get("/buildings/PAPER/alerts").text
    assert "&lt;b&gt;maintenance&lt;/b&gt;" in listed
    assert "No messages about it are sent before" in api.get("/alerts/2").text
    assert api.post("/silences/1/end").status_code == 303
    assert "End it now" not in api.get("/buildings/PAPER/alerts").text

    for path, wrong in (
        ("/alerts/2/acknowledge", {}),
        ("/alerts/2/inspect", {"note": "x", "outcome": "perhaps"}),
        ("/alerts/2/inspect", {"note": "x", "outcome": "confirmed", "reference": "never"}),
        ("/buildings/PAPER/silences", silence | {"hours": "-1"}),
        ("/buildings/PAPER/silences", silence | {"hours": "9999999999"}),
    ):
        assert api.post(path, data=wrong).status_code == 409, (path, wrong)

    with sessions.begin() as session:
        viewer = keys.create(session, "viewer", Role.viewer, monitored_building.NOW)
    with client(database_url) as reading:
        reading.headers["X-API-Key"] = viewer
        assert "Acknowledge it" not in reading.get("/alerts/2").text
        assert reading.post("/alerts/2/acknowledge", data={"note": "x"}).status_code == 403


def test_an_open_alert_is_listed_behind_any_number_of_later_ones(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        code = session.scalars(select(Building.code)).one()
        first = session.scalars(select(Alert).where(Alert.closed_at.is_(None)).order_by(Alert.id)).first()
        assert first is not None
        columns = {one.key: getattr(first, one.key) for one in inspect(Alert).column_attrs if one.key != "id"}
        ended = columns | {"state": "resolved", "closed_at": first.began_at + AGE}
        session.add_all(Alert(**ended) for _ in range(LISTED))
    page = unescape(api.get(f"/buildings/{code}/alerts").text)
    assert f'href="/alerts/{first.id}"' in page
    assert "No alert is open" not in page
    assert f"Only those among the latest {LISTED} alerts of the building are listed here" in page


def test_ending_an_alert_ends_its_parts_and_shows_the_consequences_first(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    """A loss in both directions: one alert, dated between two earthquakes; its end, and the drift page after it."""
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    stored_histories.store_and_monitor(
        sessions, building, stored_histories.store_history_in_both(26, onset=22, loss=0.08), stored_histories.start(27)
    )
    with client(database_url) as api:
        every = api.get("/api/v1/alerts?state=open").json()["items"]
        (alert,) = [one for one in every if one["cause"].startswith("stiffness")]
        assert {one["subject"]: one["state"] for one in alert["parts"]} == {
            "x": "active",
            "y": "active",
            "xy": "active",
        }
        began = [datetime.fromisoformat(alert[name]) for name in ("changed_after", "changed_by")]
        assert began == [stored_histories.start(21), stored_histories.start(22)]
        page = unescape(api.get(f"/alerts/{alert['id']}").text)
        first, last = (f"{one:%-d %B %Y}" for one in began)
        assert re.search(f"It began between the earthquakes of {first}, .* and {last}, ", page)
        assert re.search(
            r"<th scope=\"row\">direction y<td class=\"state active\">active<td class=\"number\">−\d+\.\d %", page
        )
        assert "All its parts end with it." in page
        assert (
            "then needs at least 20 more earthquakes before it can raise an alarm again. All directions share" in page
        )
        assert re.search(
            f"begins with the earthquake of {last}.* 4 earthquakes count already; .* at least 16 more", page
        )
        form = {"outcome": "confirmed", "note": "two bearings replaced", "reference": "since_it_began"}
        assert api.post(f"/alerts/{alert['id']}/inspect", data=form).status_code == 303
        assert "These results are being computed again" in api.get("/buildings/PAPER/drift").text
        stored_histories.do_waiting_work(sessions, stored_histories.start(27))
        ended = [one for one in api.get("/api/v1/alerts").json()["items"] if "stiffness" in one["cause"]]
        assert [(one["id"], one["state"]) for one in ended] == [(alert["id"], "resolved")]
        assert {one["state"] for one in ended[0]["parts"]} == {"resolved"}
        page = api.get(f"/alerts/{alert['id']}").text
        assert '<th scope="row">direction y<td class="state resolved">resolved<td' in page
        drift = unescape(api.get("/buildings/PAPER/drift").text)
        assert f"<li>Stiffness of the isolation layer: a new reference period began on {began[1]:%Y-%m-%d}" in drift
        assert "UTC; needs 16 more earthquakes before it can raise an alarm." in drift
        assert "The rules found nothing" not in drift
