"""The report on an earthquake: its words, one page whatever is said, and texts of people that remain texts."""

import io
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from html import unescape
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
import typst
from alert_candidates import gain_error, softer_isolators
from alert_fixtures import SOON, with_stored_events
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, day, earthquake
from command import menshin
from PIL import Image
from pypdf import PdfReader
from sqlalchemy.orm import Session, sessionmaker

from service.alerts.reconciliation import reconcile
from service.analyses.tables import Analysis, DirectionResult
from service.buildings import store as building_store
from service.db.blobs import encode
from service.documents import paper
from service.drift.alert_candidates import limit_candidates
from service.language.choice import speaking
from service.records.tables import Event, Waveform
from service.reports import rendering
from service.reports.earthquake import EarthquakeReport, earthquake_report
from service.reports.pictures import Picture, pictures

pytestmark = pytest.mark.sqlite

NOW = datetime(2026, 5, 1, tzinfo=UTC)
HOSTILE = '#read("/etc/passwd") $x$ *b* @ref <script>alert(1)</script> \\ ] }'


@pytest.fixture
def stored(sessions: sessionmaker[Session]) -> Iterator[Session]:
    with sessions() as session:
        yield session


def add_histories(session: Session, event: Event) -> None:
    """A loop in both directions, and the slab's acceleration as recorded."""
    turn = np.linspace(0.0, 4 * np.pi, 400)
    results = session.query(DirectionResult).join(Analysis).filter(Analysis.event_id == event.id)
    for one in results:
        one.displacement = encode((one.peak_displacement or 0.0) * np.sin(turn))
        one.force, one.rate, one.count = encode(1e6 * np.sin(turn + 0.3)), 10.0, turn.size
    recorded = {"start": event.start, "rate": 10.0, "count": turn.size, "gain": 1e-6}
    samples = encode((1e6 * np.sin(turn)).astype(np.int32))
    channel = f"XX.{event.building.code}.01.HNX"
    session.add(Waveform(event_id=event.id, channel=channel, samples=samples, **recorded))
    session.flush()


def made(session: Session, event: Event) -> tuple[EarthquakeReport, tuple[Picture, ...]]:
    """The report on an earthquake with its pictures."""
    session.expire_all()
    report = earthquake_report(session, event.id)
    return report, pictures(session, report)


def read(content: bytes) -> tuple[int, str]:
    """Number of pages, and the text of the first, in one line."""
    pages = PdfReader(io.BytesIO(content)).pages
    return len(pages), " ".join(pages[0].extract_text().replace("\u200b", "").split())


def test_pdf_and_html_say_what_the_verdict_says(stored: Session) -> None:
    of = building(stored)
    event = earthquake(stored, of, day(1), STRONG)
    add_histories(stored, event)
    add_comparison(stored, event)
    reconcile(stored, of.id, limit_candidates(stored, of.id), "events", day(1) + SOON)
    report, drawn = made(stored, event)
    assert (report.level, report.direction, report.stamps) == ("inspect", "x", ())
    assert {place.where for place in report.places} >= {"Isolators"}
    assert all(one.svg and not one.reason for one in drawn)
    printed = rendering.pdf(report, drawn, NOW)
    pages, text = read(printed)
    html = unescape(rendering.html(report, drawn, NOW).decode())
    assert pages == 1
    assert b"pdfaid" in printed
    for shown in (text, " ".join(html.split())):
        assert "INSPECT" in shown
        for words in (
            "Have the building inspected before normal use.",
            "Automatic, not reviewed by an engineer.",
            "a tower",
            "73.75 ± 0.07 %",
            "33 / 67 / 100 %",
            "▲ exceeded: inspect",
            "▲ exceeded: watch",
            "Menshin's default; design_displacement is 400 mm in the building file",
            "bulging, cracks, debonding or tilt",
            "beyond the inspection limit",
            "(Asia/Tokyo)",
            f"{event.start:%Y-%m-%d %H:%M:%S} UTC",
            "Revision 1",
            "JMA intensity (unofficial)",
            "1 of 4 channels recorded",
        ):
            assert words in shown, words
    assert " safe" not in text
    assert "all clear" not in text.lower()
    unmeasured = {"Data quality", "Health of the sensors", "Health of the clocks"}
    numbers = [one for one in report.checks if one.title not in unmeasured]
    assert len(numbers) == len(report.checks) - len(unmeasured)
    assert html.count("<svg") == len(["symbol"]) + len(numbers) + len(drawn)
    assert "<script" not in html


def test_a_report_says_once_that_it_replaces_no_inspection(stored: Session) -> None:
    of = building(stored)
    for number, (moved, level) in enumerate(((0.02, "normal"), (STRONG, "inspect")), 1):
        event = earthquake(stored, of, day(number), moved)
        add_comparison(stored, event)
        report, drawn = made(stored, event)
        assert report.level == level
        html = " ".join(unescape(rendering.html(report, drawn, NOW).decode()).split())
        for shown in (read(rendering.pdf(report, drawn, NOW))[1], html):
            assert shown.count("does not replace an inspection") == 1


def test_the_same_facts_give_the_same_report_and_a_change_another_one(stored: Session) -> None:
    event = earthquake(stored, building(stored), day(1))
    before = earthquake_report(stored, event.id)
    assert earthquake_report(stored, event.id) == before
    add_comparison(stored, event)
    assert earthquake_report(stored, event.id).checks != before.checks
    drill = earthquake_report(stored, event.id, "DRILL – NOT REAL")
    assert drill.stamps[0].startswith("DRILL – NOT REAL")
    event.state = "queued"
    assert earthquake_report(stored, event.id).stamps[0].startswith("PROVISIONAL: its analysis has not finished")


def worst_event(stored: Session) -> Event:
    """Long names, nothing decided, and texts of a mischievous person."""
    of = building(stored, limits="damper_stroke = 0.3\n")
    of.name = f"{HOSTILE} 免震ビル 🏢 {'W' * 3000}"
    warnings = tuple(f"{HOSTILE} {number} {'long ' * 100}" for number in range(40))
    event = earthquake(stored, of, day(1), quality=warnings)
    result = stored.query(Analysis).filter_by(event_id=event.id).one()
    kinds = cycle(("record", "spike", "clock"))
    result.quality = [{**one, "kind": next(kinds)} for one in result.quality]
    shaking = result.shaking
    assert shaking is not None
    shaking.floors = [dict(one, level=f"{HOSTILE} {'roof' * 60}", std=None) for one in shaking.floors]
    shaking.storeys, shaking.is_below_isolators = [], False
    for one in result.directions:
        one.peak_displacement_std = one.residual_displacement = None
    alerts = (softer_isolators(), gain_error(), softer_isolators(cause="damping/x", is_sure=False))
    reconcile(stored, of.id, [with_stored_events(one, (event.id,) * 3) for one in alerts], "events", day(1) + SOON)
    stored.commit()
    return event


def test_one_page_with_long_names_nothing_decided_and_texts_of_a_mischievous_person(
    stored: Session, database_url: str
) -> None:
    event = worst_event(stored)
    report, drawn = made(stored, event)
    assert {check.outcome for check in report.checks} == {"undecided"}
    printed = rendering.pdf(report, drawn, NOW)
    pages, text = read(printed)
    assert pages == 1
    assert b"pdfaid" not in printed  # no font has all these letters
    assert '#read("/etc/passwd")' in text
    assert "root:" not in text
    assert "免震ビル" in text
    for check in report.checks:
        assert check.settles
        assert check.settles.partition(".")[0].replace("\u200b", "")[:40] in text
    assert "and 37 more" in text
    assert "PGA" not in text  # the ground was not recorded
    assert "Peak acceleration above the isolators" in text
    with client(database_url) as api:
        page = api.get(f"/api/v1/events/{event.id}/report.html")
    assert "<script" not in page.text
    assert "&lt;script&gt;" in page.text


def test_in_japanese_too_it_has_one_page_and_is_for_archives(stored: Session, database_url: str) -> None:
    worst = worst_event(stored)
    of = building(stored)
    event = earthquake(stored, of, day(1), STRONG)
    add_histories(stored, event)
    stored.commit()
    with speaking("ja"):
        printed = rendering.pdf(*made(stored, event), NOW)
        pages, text = read(printed)
        html = unescape(rendering.html(*made(stored, event), NOW).decode())
        assert read(rendering.pdf(*made(stored, worst), NOW))[0] == 1
    assert (pages, b"pdfaid" in printed) == (1, True)
    assert PdfReader(io.BytesIO(printed)).trailer["/Root"]["/Lang"] == "ja"
    assert '<html lang="ja">' in html
    for shown in (text.replace(" ", ""), html):
        for words in ("地震報告書", "判定項目", "点検箇所と内容", "しきい値の出典", "復元力", "2024年1月2日"):
            assert words in shown, words
    english = re.findall(r"[a-z]{3,}(?: [a-z]{3,}){2,}", re.sub(r"<style>.*?</style>|<[^>]*>", " ", html, flags=re.S))
    assert english == []
    address = f"/api/v1/events/{event.id}/report.html"
    with client(database_url) as api:
        asked = api.get(address, params={"language": "ja"})
        assert asked.headers["content-language"] == "ja"
        assert "地震報告書" in asked.text
        assert "地震報告書" in api.get(address, headers={"Accept-Language": "ja"}).text
        answer = api.get(address)
        assert (answer.headers["content-language"], "Earthquake report" in answer.text) == ("en", True)
        assert asked.headers["etag"] != answer.headers["etag"]
        assert api.get(address, params={"language": "xx"}).status_code == 422


def test_a_template_reads_no_file_and_fetches_no_package(tmp_path: Path) -> None:
    (tmp_path / "secret.txt").write_text("secret", encoding="utf-8")
    for wish in (
        '#read("/etc/passwd")',
        f'#read("{tmp_path}/secret.txt")',
        '#read("../../../etc/passwd")',
        '#import "@preview/cetz:0.4.0"',
    ):
        with pytest.raises(typst.TypstError):
            paper.pdf(wish, {}, NOW)
    assert "#read" in read(paper.pdf("#json(bytes(sys.inputs.data)).text", {"text": '#read("/etc/passwd")'}, NOW))[1]


def test_printed_in_grey_the_level_and_the_limits_remain(stored: Session) -> None:
    event = earthquake(stored, building(stored), day(1), STRONG)
    report, drawn = made(stored, event)
    [page] = rendering.pages(report, drawn, NOW)
    with Image.open(io.BytesIO(page)) as shown:
        colours = np.asarray(shown.convert("RGB"), dtype=int)
        grey = np.asarray(shown.convert("L"), dtype=int)
    assert grey.shape == (1403, 992)  # A4 at 120 pixels per inch
    assert int((colours.max(axis=2) - colours.min(axis=2)).max()) < 40  # colour carries nothing
    assert (grey < 64).mean() > 0.02


def test_the_api_serves_it_and_an_unknown_event_is_not_found(stored: Session, database_url: str) -> None:
    event = earthquake(stored, building(stored), day(1))
    stored.commit()
    address = f"/api/v1/events/{event.id}/report"
    with client(database_url) as api:
        printed = api.get(f"{address}.pdf")
        shown = api.get(f"{address}.html")
        assert (printed.status_code, printed.headers["content-type"]) == (200, "application/pdf")
        assert printed.content.startswith(b"%PDF")
        assert f'filename="{event.building.code}-' in printed.headers["content-disposition"]
        assert shown.headers["content-type"].startswith("text/html")
        assert "default-src 'none'" in shown.headers["content-security-policy"]
        assert api.get(f"{address}.pdf", headers={"If-None-Match": printed.headers["etag"]}).status_code == 304
        assert api.get("/api/v1/events/9999/report.pdf").status_code == 404
        assert f'href="{address}.pdf"' in api.get(f"/events/{event.id}").text


def test_the_command_writes_a_file(
    stored: Session, database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    event = earthquake(stored, building(stored), day(1))
    number, code = event.id, event.building.code
    stored.commit()
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    monkeypatch.chdir(tmp_path)
    done = menshin("report", number)
    assert done.exit_code == 0, done.output
    [file] = tmp_path.glob(f"{code}-*-report.pdf")
    assert read(file.read_bytes())[0] == 1
    assert menshin("report", number, "--out", tmp_path / "sub" / "a.html").exit_code == 0
    assert "Earthquake report" in (tmp_path / "sub" / "a.html").read_text("utf-8")
    assert menshin("report", number, "--out", tmp_path / "ja.html", "--language", "ja").exit_code == 0
    assert "地震報告書" in (tmp_path / "ja.html").read_text("utf-8")
    assert menshin("report", number, "--language", "xx").exit_code == 2
    unknown = menshin("report", 9999)
    assert (unknown.exit_code, "9999" in unknown.stderr) == (1, True)
    assert menshin("report", number, "--out", "a.doc").exit_code == 2


def test_an_earthquake_without_a_usable_record_has_a_report(stored: Session) -> None:
    event = earthquake(stored, building(stored), day(1))
    event.state, event.reason = "refused", "no channel of the base slab"
    for one in stored.query(Analysis).filter_by(event_id=event.id):
        one.current = False
    stored.flush()
    report, drawn = made(stored, event)
    pages, text = read(rendering.pdf(report, drawn, NOW))
    assert pages == 1
    assert "NO DATA" in text
    assert text.count("no channel of the base slab") == 1
    assert "Bars: the value" not in text
    assert "Inspect the isolators if the shaking was strong" in text
    assert all(one.reason for one in drawn)
    assert building_store.described(stored, event.building).design_spectrum is None
