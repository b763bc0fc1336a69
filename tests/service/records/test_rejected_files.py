"""A file that cannot be used is visible: on the pages, by the API, in the log and as an alert, with the reason."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from html import unescape
from pathlib import Path

import databases
import monitored_building
import numpy as np
import paper_records
import pytest
from api_client import client
from monitoring_server import Page, Server, building_file, miniseed, stream
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import operator_actions, periodic_checks
from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.db import sessions as opened
from service.formats import FormatError, read
from service.records.source_poller import SourcePoller
from service.records.tables import Recording
from service.settings import Settings

SETTINGS = Settings(settle_time=0, http_retries=0, retry_delay=0.01)
WHOLE = miniseed(stream())
TRUNCATED = "truncated.mseed is truncated: it ends in the middle of a record, 300 of 512 bytes; fetch it again"


@pytest.fixture
def url(tmp_path: Path) -> str:
    return databases.sqlite(tmp_path)


@pytest.fixture
def sessions(url: str) -> Iterator[sessionmaker[Session]]:
    made = opened.sessions(url)
    yield made
    made.kw["bind"].dispose()


@pytest.fixture
def drop(tmp_path: Path, sessions: sessionmaker[Session]) -> Path:
    """A watched folder with a sound file, junk, and half a file."""
    place = tmp_path / "drop"
    place.mkdir()
    (place / "good.mseed").write_bytes(miniseed(stream()))
    (place / "junk.mseed").write_bytes(b"hello")
    (place / "truncated.mseed").write_bytes(miniseed(stream(seed=2))[: 5 * 512 + 300])
    with sessions.begin() as session:
        building_store.add(session, building_file("folder", str(place)), place, datetime.now(UTC))
    return place


def look(sessions: sessionmaker[Session], later: timedelta = timedelta(0)) -> datetime:
    """A look at every source, and the checks a minute after it."""
    now = datetime.now(UTC) + later
    SourcePoller(sessions, SETTINGS, lambda: now, lambda _: None).poll("TOWER")
    periodic_checks.check_buildings(sessions, SETTINGS, now + timedelta(minutes=1))
    return now + timedelta(minutes=1)


def alerts(sessions: sessionmaker[Session], cause: str = "rejected") -> list[tuple[str, str, dict[str, object]]]:
    with sessions() as session:
        rows = session.query(Alert).filter(Alert.cause == cause).order_by(Alert.id)
        return [(row.state, row.summary, dict(row.evidence)) for row in rows]


def test_rejected_files_are_in_the_api_on_the_pages_in_the_log_and_an_alert(
    url: str, sessions: sessionmaker[Session], drop: Path, caplog: pytest.LogCaptureFixture
) -> None:
    look(sessions)
    lines = [record.getMessage() for record in caplog.records if "was rejected" in record.getMessage()]
    unknown = "junk.mseed has an unknown format (it begins with b'hello')"
    assert lines[0].startswith(f"junk.mseed of TOWER was rejected: {unknown}")
    assert lines[1] == f"truncated.mseed of TOWER was rejected: {TRUNCATED}"
    assert len(lines) == 2
    with client(url) as api:
        listed = api.get("/api/v1/recordings", params={"state": "rejected", "building": "TOWER"}).json()
        assert [(one["name"], one["state"], one["size"]) for one in listed["items"]] == [
            ("truncated.mseed", "rejected", 2860),
            ("junk.mseed", "rejected", 5),
        ]
        assert listed["items"][0]["reason"] == TRUNCATED
        first = api.get("/api/v1/recordings", params={"limit": 1}).json()
        second = api.get("/api/v1/recordings", params={"limit": 1, "cursor": first["next"]}).json()
        assert [first["items"][0]["name"], second["items"][0]["name"]] == ["truncated.mseed", "junk.mseed"]
        assert api.get("/api/v1/recordings", params={"building": "NONE"}).status_code == 404
        rows = api.get("/api/v1/recordings", params={"state": "read", "format": "csv"}).text.splitlines()
        assert len(rows) == 2
        assert "good.mseed" in rows[1]
        page = api.get("/buildings/TOWER/recordings?state=rejected").text
        assert "rejected (2)" in page
        assert TRUNCATED in page
        assert "good.mseed" not in page
        for path in ("/", "/buildings/TOWER"):
            home = api.get(path).text
            assert 'href="/buildings/TOWER/recordings?state=rejected">2 files could not be used' in home
    ((state, summary, evidence),) = alerts(sessions)
    assert (state, summary) == ("active", "2 files or more could not be used")
    assert (evidence["files"], evidence["first"]) == (2, "junk.mseed")


def as_csv(unit: str = "gal", sample: str = "0.1") -> bytes:
    """A record of the building, the last sample of its base slab as given."""
    columns = ", ".join(f"XX.TOWER.0{number}.HNX [{unit}]" for number in range(3))
    rows = ["0.1, 0.1, 0.1"] * 2000 + [f"0.1, {sample}, 0.1"]
    return f"# start: 2024-01-01T00:00:00Z\n# rate: 100\n{columns}\n{chr(10).join(rows)}\n".encode()


def floats(value: float, gap: float = 0.1) -> bytes:
    """miniSEED with one sample of the base slab replaced, in floating point as some loggers write it."""
    made = stream()
    for trace in made:
        trace.data = (trace.data * gap).astype("float32")
    made[1].data[1234] = value
    return miniseed(made)


FAULTS = {
    "unknown unit": ("a.csv", as_csv("foot"), "column 'XX.TOWER.00.HNX [foot]' of a.csv: unit 'foot' is not known"),
    "no unit": ("a.csv", as_csv(""), "column 'XX.TOWER.00.HNX []' of a.csv: the unit is missing; use one of m/s**2"),
    "unit of another quantity": (
        "a.csv",
        as_csv("mm"),
        "a.csv: XX.TOWER.00.HNX measures acceleration according to the building file, but the unit of its records is "
        "one of displacement",
    ),
    "unit a million times too large": (
        "a.mseed",
        floats(0.0, gap=1e6),
        "a.mseed: a tenth of the samples of XX.TOWER.00.HNX lie more than",
    ),
    "NaN in a table": ("a.csv", as_csv(sample="nan"), "a.csv: 1 of 2001 samples of XX.TOWER.01.HNX are not numbers"),
    "NaN of a logger": (
        "a.mseed",
        floats(float("nan")),
        "a.mseed: 1 of 2000 samples of XX.TOWER.01.HNX are not numbers, the first at sample 1235",
    ),
    "infinity": ("a.mseed", floats(float("inf")), "a.mseed: 1 of 2000 samples of XX.TOWER.01.HNX are not numbers"),
    "truncated": ("a.mseed", miniseed(stream())[:-100], "a.mseed is truncated: it ends in the middle of a record"),
    "a clock that was never set": (
        "a.mseed",
        miniseed(stream(datetime(1970, 1, 1, tzinfo=UTC))),
        "a.mseed: XX.TOWER.00.HNX was recorded from 1970-01-01 00:00:00",
    ),
    "another building": ("a.mseed", miniseed(stream(locations=("07",))), "a.mseed: no channel of this building: found"),
}


@pytest.mark.parametrize(("name", "data", "expected"), FAULTS.values(), ids=FAULTS)
def test_a_record_that_is_wrong_is_named_with_its_fault_everywhere(
    url: str,
    sessions: sessionmaker[Session],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    name: str,
    data: bytes,
    expected: str,
) -> None:
    (tmp_path / "drop").mkdir()
    (tmp_path / "drop" / name).write_bytes(data)
    with sessions.begin() as session:
        building_store.add(session, building_file("folder", str(tmp_path / "drop")), tmp_path, datetime.now(UTC))
    look(sessions)
    everywhere(url, sessions, caplog, name, expected)


def test_a_record_whose_unit_nothing_gives(
    url: str, sessions: sessionmaker[Session], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "drop").mkdir()
    (tmp_path / "drop" / "a.mseed").write_bytes(miniseed(stream()))
    with sessions.begin() as session:
        building_store.add(
            session, building_file("folder", str(tmp_path / "drop"), gain=""), tmp_path, datetime.now(UTC)
        )
    look(sessions)
    everywhere(url, sessions, caplog, "a.mseed", "a.mseed: the unit of XX.TOWER.00.HNX")


def everywhere(
    url: str, sessions: sessionmaker[Session], caplog: pytest.LogCaptureFixture, name: str, expected: str
) -> None:
    """Log, API, page, alert and the alert's page name the file and say in words what is wrong."""
    (line,) = [record.getMessage() for record in caplog.records if "was rejected" in record.getMessage()]
    assert line.startswith(f"{name} of TOWER was rejected: {expected}")
    ((state, summary, evidence),) = alerts(sessions)
    assert (state, summary, evidence["first"]) == ("active", "A file could not be used", name)
    assert str(evidence["reason"]).startswith(expected)
    with client(url) as api:
        (listed,) = api.get("/api/v1/recordings", params={"state": "rejected"}).json()["items"]
        assert listed["reason"].startswith(expected)
        assert expected in unescape(api.get("/buildings/TOWER/recordings?state=rejected").text)
        (alert,) = (one for one in api.get("/api/v1/alerts").json()["items"] if one["cause"] == "rejected")
        assert f"The first is {name}: {expected}" in unescape(api.get(f"/alerts/{alert['id']}").text)


@pytest.mark.parametrize("kind", ["archive", "fdsnws"])
@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (b"<html><title>Log in</title>", "is an HTML page (Log in), not data; check the address that answered with it"),
        (WHOLE[:-100], "is truncated: it ends in the middle of a record, 412 of 512 bytes"),
        (floats(float("nan")), "1 of 2000 samples of XX.TOWER.01.HNX are not numbers"),
    ],
    ids=["page", "truncated", "NaN"],
)
def test_an_answer_of_a_server_that_is_no_record_is_named_with_its_fault_everywhere(
    url: str,
    sessions: sessionmaker[Session],
    server: Server,
    caplog: pytest.LogCaptureFixture,
    kind: str,
    answer: bytes,
    expected: str,
) -> None:
    if kind == "archive":
        server.pages["/events/"] = Page(b"a.mseed")
        server.pages["/events/a.mseed"] = Page(answer)
        text = building_file(kind, f"{server.address}/events/")
    else:
        server.pages["/fdsnws/dataselect/1/query"] = Page(answer)
        text = building_file(kind, server.address, "since = 2024-01-01T00:00:00Z")
    with sessions.begin() as session:
        building_store.add(session, text, Path("/"), datetime(2024, 1, 1, 1, tzinfo=UTC))
    look(sessions)
    with sessions() as session:
        (name,) = session.scalars(select(Recording.name).where(Recording.state == "refused"))
    assert name == "a.mseed" if kind == "archive" else name.startswith("20240101T000000-")
    glue = " " if expected.startswith("is ") else ": "
    everywhere(url, sessions, caplog, name, f"{name}{glue}{expected}")


def test_a_dead_channel_is_named_with_its_file_everywhere(
    url: str, sessions: sessionmaker[Session], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "drop").mkdir()
    samples = paper_records.records(np.random.default_rng(4), 0.3)
    samples[monitored_building.BASE] = np.zeros_like(samples[monitored_building.BASE])
    monitored_building.watch(sessions, tmp_path / "drop", [paper_records.miniseed(samples)])
    fault = "every sample is 0 (SI); check the sensor and its cable"
    (line,) = [one.getMessage() for one in caplog.records if fault in one.getMessage()]
    assert line.startswith(f"event 1 of PAPER (0.mseed): {monitored_building.BASE} {fault}")
    periodic_checks.check_buildings(sessions, Settings(channel_misses=1), monitored_building.NOW)
    with client(url) as api:
        event = api.get("/api/v1/events/1").json()
        assert (monitored_building.BASE, "dead") in [(one["channel"], one["kind"]) for one in event["quality"]]
        (open_alert,) = event["verdict"]["open_alerts"]
        assert (open_alert["cause"], open_alert["rests_here"]) == (f"channel/{monitored_building.BASE}", True)
        assert fault in unescape(api.get("/events/1").text)
        alert = unescape(api.get(f"/alerts/{open_alert['id']}").text)
    assert f"In the latest earthquake, event 1 (0.mseed): {fault}" in alert
    assert '<a href="/events/1">1</a>' in alert


def test_the_alert_counts_and_ends_by_time_or_by_a_person(sessions: sessionmaker[Session], drop: Path) -> None:
    now = look(sessions)
    (drop / "more.mseed").write_bytes(b"hello again")
    look(sessions, timedelta(minutes=2))
    ((state, _, evidence),) = alerts(sessions)
    assert (state, evidence["files"]) == ("active", 3)
    with sessions.begin() as session:
        row = session.query(Alert).filter(Alert.cause == "rejected").one()
        operator_actions.inspect(session, row, "an engineer", "confirmed", "removed", None, now + timedelta(minutes=3))
    look(sessions, timedelta(minutes=5))
    assert [state for state, _, _ in alerts(sessions)] == ["resolved"]
    (drop / "last.mseed").write_bytes(b"hello a last time")
    look(sessions, timedelta(minutes=7))
    assert [(state, evidence["files"]) for state, _, evidence in alerts(sessions)] == [("resolved", 3), ("active", 1)]
    look(sessions, timedelta(days=7, minutes=10))
    assert [state for state, _, _ in alerts(sessions)] == ["resolved", "resolved"]


def test_a_source_with_a_wrong_address_is_stated_everywhere_after_the_first_look(
    url: str, sessions: sessionmaker[Session], server: Server, caplog: pytest.LogCaptureFixture
) -> None:
    with sessions.begin() as session:
        text = building_file("archive", f"{server.address}/nowhere/?token=t0ken")
        building_store.add(session, text, Path("/"), datetime.now(UTC))
    look(sessions)
    printed = f"{server.address}/nowhere/ answered 404 Not Found; nothing is served at this path; correct location"
    assert any(printed in record.getMessage() for record in caplog.records)
    ((state, summary, evidence),) = alerts(sessions, "source")
    assert (state, summary) == ("active", "The monitoring server has never answered at its address")
    assert printed in str(evidence["error"])
    with client(url) as api:
        (source,) = api.get("/api/v1/sources").json()["items"]
        assert printed in source["error"]
        for path in ("/", "/buildings/TOWER", "/buildings/TOWER/recordings"):
            page = api.get(path).text
            assert printed in page
            assert "t0ken" not in page


@pytest.fixture
def server() -> Iterator[Server]:
    from monitoring_server import monitoring_server

    with monitoring_server() as made:
        yield made


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (WHOLE[:300], "a.mseed is truncated: it ends in the middle of a record, 300 of 512 bytes"),
        (WHOLE[:-100], "a.mseed is truncated: it ends in the middle of a record, 412 of 512 bytes"),
        (WHOLE[:100] + bytes(412), "a.mseed is truncated or damaged"),
        (WHOLE[:50], "a.mseed is truncated or damaged: its 50 bytes cannot be read as miniSEED"),
        (b"", "a.mseed is empty"),
        (b"<html><title>Log in</title>", "a.mseed is an HTML page (Log in), not data"),
        (b"Origin Time  nonsense", "a.mseed is truncated or empty: it holds no samples"),
    ],
)
def test_a_reason_names_the_file_and_what_is_wrong_in_words(data: bytes, expected: str) -> None:
    with pytest.raises(FormatError) as refused:
        read("a.mseed", data, {})
    assert expected in str(refused.value)
    assert "object at 0x" not in str(refused.value)
    assert "Cannot open file" not in str(refused.value)
