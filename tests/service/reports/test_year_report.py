"""The report on a year: every earthquake with its level, alerts, inspections, messages, and what is missing."""

import io
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from html import unescape
from pathlib import Path

import pytest
from accessible import problems
from alert_candidates import DAY, START, softer_isolators
from alert_fixtures import AGE, SOON, with_stored_events
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, day, earthquake
from browsers import needs_chromium
from command import menshin
from pypdf import PdfReader
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service.alerts.messages import write_event_message
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert, AlertChange, BuildingInspection, Inspection
from service.buildings.tables import Building
from service.notify.tables import Receiver
from service.records.tables import Event
from service.reports import rendering, year
from service.reports.earthquake import earthquake_report
from service.reports.pictures import pictures, year_pictures
from service.reports.year import YearReport, year_report

pytestmark = pytest.mark.sqlite

YEAR = START.year
NEXT = datetime(YEAR + 1, 1, 2, tzinfo=UTC)
NOTE = '#read("/etc/passwd") <script> bolts tightened'


@pytest.fixture
def stored(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions() as session:
        yield session


@pytest.fixture
def of(stored: Session) -> Building:
    """A building with a strong earthquake, a refused one, an alert that was acknowledged and ended, and a recipient."""
    made = building(stored)
    subscribed = {"kinds": ["event", "alert"], "severities": ["normal", "note", "warning", "alarm"], "origin": "api"}
    stored.add(
        Receiver(
            building_id=made.id, name="manager", kind="email", address="m@example.org", created_at=START, **subscribed
        )
    )
    strong = earthquake(stored, made, day(1), STRONG)
    add_comparison(stored, strong, -0.08)
    softer = with_stored_events(softer_isolators(), (strong.id,) * 3)
    reconcile(stored, made.id, [softer], "events", day(1) + SOON)
    write_event_message(stored, strong.id, AGE, strong.end + SOON)
    refused = earthquake(stored, made, day(2))
    refused.state, refused.reason = "refused", "no channel of the base slab"
    alert = stored.query(Alert).one()
    alert.acknowledged_by, alert.acknowledged_at, alert.acknowledgement = "A. Engineer", day(3), "seen"
    alert.state, alert.closed_at, alert.assigned_to = "resolved", day(9), "D. Mender"
    alert.changes.append(
        AlertChange(at=day(9), state="resolved", by="B. Inspector", note=NOTE, summary=alert.summary, evidence={})
    )
    alert.inspections.append(
        Inspection(at=day(9), by="B. Inspector", outcome="confirmed", note=NOTE, evidence=alert.evidence)
    )
    stored.add(
        BuildingInspection(
            building_id=made.id,
            inspected_at=day(5),
            recorded_at=day(6),
            by="C. Signer",
            result="restricted",
            comment="lift out of use",
            level="inspect",
            headline="inspect: displacement",
        )
    )
    earthquake(stored, made, START + 800 * DAY, 0.03)
    stored.commit()
    return made


def read(content: bytes) -> tuple[int, str]:
    """Number of pages, and their text in one line."""
    pages = PdfReader(io.BytesIO(content)).pages
    return len(pages), " ".join(" ".join(one.extract_text() for one in pages).replace("\u200b", "").split())


def test_a_year_says_what_happened_and_who_was_told(stored: Session, of: Building) -> None:
    report = year_report(stored, of.code, YEAR, NEXT)
    assert [(one.words, one.displacement) for one in report.earthquakes] == [
        ("undecided", "100"),
        ("inspect", "295"),
        ("no data", "20.0"),
    ]
    assert report.earthquakes[1].change == "x −8.0 ± 2.0 %, y −8.0 ± 2.0 %"
    [alert] = report.alerts
    assert alert.answered.startswith("A. Engineer, 2024")
    assert alert.answered.endswith(": seen; assigned to D. Mender")
    assert [(one.by, one.outcome) for one in report.inspections] == [
        ("C. Signer", "restricted use"),
        ("B. Inspector", "confirmed"),
    ]
    assert report.basis.startswith("Inspected by C. Signer")
    assert "does not cover" in report.basis
    assert [one.recipients for one in report.messages] == ["manager (email) waiting"]
    assert report.gaps[0].value.startswith("1, ")
    pages, text = read(rendering.pdf(report, year_pictures(report), NEXT))
    html = unescape(rendering.html(report, year_pictures(report), NEXT).decode())
    assert pages == 1
    for shown in (text, " ".join(html.split())):
        for words in (
            f"Report on {YEAR}",
            "3: 1 inspect, 1 no data, 1 undecided",
            "295 mm",
            "refused: no channel of the base slab",
            "8 % softer in direction x",
            "A. Engineer, 2024",
            '#read("/etc/passwd")',
            "bolts tightened",
            "manager (email) waiting",
            "Inspected by C. Signer",
            "lift out of use",
        ):
            assert words in shown, words
        assert "root:" not in shown
    assert "<script" not in rendering.html(report, year_pictures(report), NEXT).decode()
    assert "m@example.org" not in html


def test_a_year_that_is_not_over_says_so_and_one_without_earthquakes_too(stored: Session, of: Building) -> None:
    assert "NOT OVER" in year_report(stored, of.code, YEAR, day(20)).stamps[0]
    empty = year_report(stored, of.code, YEAR - 5, NEXT)
    assert (empty.earthquakes, empty.stamps, empty.summary[0].value) == ((), (), "0")
    assert "No earthquake was recorded." in read(rendering.pdf(empty, year_pictures(empty), NEXT))[1]


def test_too_many_earthquakes_are_counted(stored: Session, of: Building, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(year, "LISTED", 2)
    report: YearReport = year_report(stored, of.code, YEAR, NEXT)
    assert [one.displacement for one in report.earthquakes] == ["100", "295"]
    assert report.omitted == ("1 weaker earthquakes are not listed, and not among the counts by level.",)


@needs_chromium
def test_both_reports_are_readable_by_everybody_and_on_a_phone(stored: Session, of: Building) -> None:
    over = year_report(stored, of.code, YEAR, NEXT)
    [strong] = stored.scalars(select(Event).where(Event.start == day(1)))
    one = earthquake_report(stored, strong.id)
    shown = [
        rendering.html(over, year_pictures(over), NEXT),
        rendering.html(one, pictures(stored, one), NEXT),
    ]
    with chromium() as browser:
        page = browser.new_context(bypass_csp=True).new_page()  # axe is a script, and a report allows none
        for html in shown:
            page.set_content(html.decode())
            assert problems(page) == []


def test_the_api_and_the_command_serve_it(
    stored: Session, of: Building, database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = of.code
    stored.rollback()
    address = f"/api/v1/buildings/{code}/reports/{YEAR}"
    with client(database_url) as api:
        printed, shown = api.get(f"{address}.pdf"), api.get(f"{address}.html")
        assert (printed.status_code, printed.headers["content-type"]) == (200, "application/pdf")
        assert shown.headers["content-type"].startswith("text/html")
        assert api.get(f"{address}.pdf", headers={"If-None-Match": printed.headers["etag"]}).status_code == 304
        assert api.get(f"/api/v1/buildings/NONE/reports/{YEAR}.pdf").status_code == 404
        assert api.get(f"/api/v1/buildings/{code}/reports/1.pdf").status_code == 404
        assert f"reports/{(START + timedelta(days=800)).year}.pdf" in api.get(f"/buildings/{code}").text
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    monkeypatch.chdir(tmp_path)
    done = menshin("report", "--building", code, "--year", YEAR, "--out", "year.html")
    assert done.exit_code == 0, done.output
    assert f"Report on {YEAR}" in (tmp_path / "year.html").read_text("utf-8")
    for wrong in (("report",), ("report", 1, "--building", code), ("report", "--building", code)):
        assert menshin(*wrong).exit_code == 2
    assert menshin("report", "--building", "NONE", "--year", YEAR).exit_code == 1
