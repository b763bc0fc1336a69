"""The verdict through the front door: pages, API and metrics never have good news while something is open."""

from collections.abc import Iterator
from html import unescape

import pytest
from alert_candidates import gain_error, softer_isolators
from alert_fixtures import SOON, with_stored_events
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, day, earthquake
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings.tables import Building
from service.drift.alert_candidates import limit_candidates
from service.records.tables import Event

pytestmark = pytest.mark.sqlite


@pytest.fixture
def stored(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions() as session:
        yield session


@pytest.fixture
def of(stored: Session) -> Building:
    return building(stored)


def answers(url: str, stored: Session, event: Event, of: Building) -> dict[str, str]:
    """The earthquake and its building for a browser and a program, with the texts of the pages."""
    stored.commit()
    addresses = {
        "event": f"/events/{event.id}",
        "home": f"/buildings/{of.code}",
        "alerts": f"/buildings/{of.code}/alerts",
        "api event": f"/api/v1/events/{event.id}",
        "api building": f"/api/v1/buildings/{of.code}",
        "metrics": "/metrics",
    }
    with client(url) as api:
        found = {name: api.get(address) for name, address in addresses.items()}
        assert {one.status_code for one in found.values()} == {200}
        documents = {name: found[name].json()["verdict"]["level"] for name in ("api event", "api building")}
        for name in documents:
            alone = api.get(f"{addresses[name]}/verdict")
            assert alone.json() == found[name].json()["verdict"]
            kept = {"If-None-Match": alone.headers["etag"]}
            assert api.get(f"{addresses[name]}/verdict", headers=kept).status_code == 304
    pages = {name: unescape(found[name].text) for name in ("event", "home", "alerts")}
    samples = [sample for one in text_string_to_metric_families(found["metrics"].text) for sample in one.samples]
    ranks = [one.value for one in samples if one.name == "menshin_verdict" and one.labels["building"] == of.code]
    return pages | documents | {"metrics": str(ranks[0])}


def levels(found: dict[str, str]) -> tuple[str, str, str]:
    """By the API of the earthquake and of the building, and by the metric."""
    return found["api event"], found["api building"], found["metrics"]


def test_an_earthquake_within_every_limit_is_normal_everywhere(
    database_url: str, stored: Session, of: Building
) -> None:
    event = earthquake(stored, of, day(1))
    add_comparison(stored, event)
    found = answers(database_url, stored, event, of)
    assert levels(found) == ("normal", "normal", "0.0")
    for page in ("event", "home"):
        assert "15 of 15 checks passed" in found[page]
        assert "This does not replace an inspection." in found[page]
        assert "Menshin's default; design_displacement is 400 mm in the building file" in found[page]
    assert "normal: 15 of 15 checks passed" in found["alerts"]


def test_nothing_is_good_news_while_a_loss_is_open(database_url: str, stored: Session, of: Building) -> None:
    events = tuple(earthquake(stored, of, day(number)) for number in (1, 2, 3))
    reconcile(
        stored,
        of.id,
        [with_stored_events(softer_isolators(), tuple(one.id for one in events))],
        "events",
        day(3) + SOON,
    )
    later = earthquake(stored, of, day(10))
    add_comparison(stored, later, -0.08, 0.004)
    found = answers(database_url, stored, later, of)
    assert levels(found) == ("watch", "watch", "1.0")
    for page in ("event", "home", "alerts"):
        assert "The isolators are 8 % softer in direction x" in found[page]
        assert "normal" not in found[page].split("<main")[1].replace("before normal use", "").replace(
            "fit for normal use", ""
        )
    shown = answers(database_url, stored, events[0], of)["event"]
    assert "The isolators are 8 % softer in direction x</a> <small>active, shown by this earthquake" in shown


def test_active_alerts_stand_above_those_on_hold(database_url: str, stored: Session, of: Building) -> None:
    event = earthquake(stored, of, day(1))
    alerts = (
        softer_isolators(),
        gain_error(),
        softer_isolators(cause="damping/x", is_sure=False, summary="Less damping"),
    )
    reconcile(stored, of.id, [with_stored_events(one, (event.id,) * 3) for one in alerts], "events", day(1) + SOON)
    stored.flush()
    assert {one.state for one in stored.query(Alert)} == {"active", "on_hold", "pending"}
    home = answers(database_url, stored, event, of)["home"]
    places = [home.index(f'<li class="{state}"') for state in ("active", "pending", "on_hold")]
    assert places == sorted(places)


def test_a_strong_earthquake_shows_the_limit_that_it_exceeded(database_url: str, stored: Session, of: Building) -> None:
    event = earthquake(stored, of, day(1), STRONG)
    add_comparison(stored, event)
    reconcile(stored, of.id, limit_candidates(stored, of.id), "events", day(1) + SOON)
    found = answers(database_url, stored, event, of)
    assert levels(found) == ("inspect", "inspect", "4.0")
    for page in ("event", "home"):
        assert "Have the building inspected before normal use." in found[page]
        assert "73.75 ± 0.07 %" in found[page]
        assert "67 % (inspect)" in found[page]
        assert "beyond the inspection limit" in found[page]
    after = earthquake(stored, of, day(2))
    add_comparison(stored, after)
    assert levels(answers(database_url, stored, after, of)) == ("inspect", "inspect", "4.0")


def test_an_alert_of_two_earthquakes_says_which_of_them_its_value_is_of(
    database_url: str, stored: Session, of: Building
) -> None:
    """Both exceed the limit; the summary has the value of the first, which moved the layer further."""
    first, last = earthquake(stored, of, day(1), STRONG), earthquake(stored, of, day(2), 0.95 * STRONG)
    for event in (first, last):
        add_comparison(stored, event)
    reconcile(stored, of.id, limit_candidates(stored, of.id), "events", day(2) + SOON)
    value = "73.8 %, beyond the inspection limit</a> <small>active, shown by "
    shown = answers(database_url, stored, first, of)
    assert f"{value}this earthquake</small>" in shown["event"]
    assert f"{value}the last earthquake, too; the value is that of another one</small>" in shown["home"]
    shown = answers(database_url, stored, last, of)
    assert f"{value}this earthquake, too; the value is that of another one</small>" in shown["event"]


def test_an_undecided_earthquake_shows_what_is_needed_to_decide(database_url: str, stored: Session) -> None:
    of = building(stored, limits="")
    event = earthquake(stored, of, day(1), quality=("XX.A: 4 spikes were removed",))
    found = answers(database_url, stored, event, of)
    assert levels(found) == ("undecided", "undecided", "2.0")
    for page in ("event", "home"):
        assert "Give design_displacement under [isolation] in the building file." in found[page]
        assert "XX.A: 4 spikes were removed." in found[page]
    assert "No alert is open. This alone does not mean that the building is normal." in found["alerts"]


def test_an_alert_that_ended_stays_on_the_page_of_its_earthquake(
    database_url: str, stored: Session, of: Building
) -> None:
    event = earthquake(stored, of, day(1))
    add_comparison(stored, event)
    reconcile(stored, of.id, [with_stored_events(softer_isolators(), (event.id,) * 3)], "events", day(1) + SOON)
    stored.flush()
    alert = stored.query(Alert).one()
    alert.state, alert.closed_at = "resolved", day(2)
    page = answers(database_url, stored, event, of)["event"]
    assert "Alerts of this time that have ended" in page
    assert "8 % softer in direction x</a> <small>resolved, shown by this earthquake" in page
