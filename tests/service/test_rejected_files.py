"""A file that cannot be used is visible: on the pages, by the API, in the log and as an alert, with the reason."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from asking import client
from monitoring import Server, building_file, miniseed, stream
from sqlalchemy.orm import Session, sessionmaker

from service import buildings, migrate
from service import sessions as opened
from service.alerting import handling, rounds
from service.database import Alert
from service.formats import FormatError, read
from service.intake.looking import Look
from service.settings import Settings

SETTINGS = Settings(settle_time=0, http_retries=0, retry_delay=0.01)
TRUNCATED = "truncated.mseed is truncated: it ends in the middle of a record, 300 of 512 bytes; fetch it again"


@pytest.fixture
def url(tmp_path: Path) -> str:
    address = f"sqlite:///{tmp_path / 'menshin.sqlite'}"
    migrate.upgrade(address)
    return address


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
        buildings.add(session, building_file("folder", str(place)), place, datetime.now(UTC))
    return place


def look(sessions: sessionmaker[Session], later: timedelta = timedelta(0)) -> datetime:
    """A look at every source, and the checks a minute after it."""
    now = datetime.now(UTC) + later
    Look(sessions, SETTINGS, lambda: now, lambda _: None).at("TOWER")
    rounds.go_round(sessions, SETTINGS, now + timedelta(minutes=1))
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
    assert lines[0].startswith("junk.mseed of TOWER was rejected: junk.mseed begins with b'hello', as no known format")
    assert lines[1] == f"truncated.mseed of TOWER was rejected: {TRUNCATED}"
    assert len(lines) == 2
    with client(url) as asking:
        listed = asking.get("/api/v1/recordings", params={"state": "rejected", "building": "TOWER"}).json()
        assert [(one["name"], one["state"], one["size"]) for one in listed["items"]] == [
            ("truncated.mseed", "rejected", 2860),
            ("junk.mseed", "rejected", 5),
        ]
        assert listed["items"][0]["reason"] == TRUNCATED
        first = asking.get("/api/v1/recordings", params={"limit": 1}).json()
        second = asking.get("/api/v1/recordings", params={"limit": 1, "cursor": first["next"]}).json()
        assert [first["items"][0]["name"], second["items"][0]["name"]] == ["truncated.mseed", "junk.mseed"]
        assert asking.get("/api/v1/recordings", params={"building": "NONE"}).status_code == 404
        rows = asking.get("/api/v1/recordings", params={"state": "read", "format": "csv"}).text.splitlines()
        assert len(rows) == 2
        assert "good.mseed" in rows[1]
        page = asking.get("/buildings/TOWER/recordings?state=rejected").text
        assert "rejected (2)" in page
        assert TRUNCATED in page
        assert "good.mseed" not in page
        for path in ("/", "/?building=TOWER"):
            home = asking.get(path).text
            assert 'href="/buildings/TOWER/recordings?state=rejected">2 files could not be used' in home
    ((state, summary, evidence),) = alerts(sessions)
    assert (state, summary) == ("active", "2 files or more could not be used")
    assert (evidence["files"], evidence["first"]) == (2, "junk.mseed")


def test_the_alert_counts_and_ends_by_time_or_by_a_person(sessions: sessionmaker[Session], drop: Path) -> None:
    now = look(sessions)
    (drop / "more.mseed").write_bytes(b"hello again")
    look(sessions, timedelta(minutes=2))
    ((state, _, evidence),) = alerts(sessions)
    assert (state, evidence["files"]) == ("active", 3)
    with sessions.begin() as session:
        row = session.query(Alert).filter(Alert.cause == "rejected").one()
        handling.inspect(session, row, "an engineer", "confirmed", "removed", None, now + timedelta(minutes=3))
    look(sessions, timedelta(minutes=5))
    assert [state for state, _, _ in alerts(sessions)] == ["resolved"]
    (drop / "last.mseed").write_bytes(b"hello a last time")
    look(sessions, timedelta(minutes=7))
    assert [(state, evidence["files"]) for state, _, evidence in alerts(sessions)] == [("resolved", 3), ("active", 1)]
    look(sessions, timedelta(days=7, minutes=10))
    assert [state for state, _, _ in alerts(sessions)] == ["resolved", "resolved"]


def test_a_source_with_a_wrong_address_is_said_everywhere_after_the_first_look(
    url: str, sessions: sessionmaker[Session], server: Server, caplog: pytest.LogCaptureFixture
) -> None:
    with sessions.begin() as session:
        text = building_file("archive", f"{server.address}/nowhere/?token=t0ken")
        buildings.add(session, text, Path("/"), datetime.now(UTC))
    look(sessions)
    said = f"{server.address}/nowhere/ answered 404 Not Found; nothing is served at this path; correct location"
    assert any(said in record.getMessage() for record in caplog.records)
    ((state, summary, evidence),) = alerts(sessions, "source")
    assert (state, summary) == ("active", "The monitoring server has never answered at its address")
    assert said in str(evidence["error"])
    with client(url) as asking:
        (source,) = asking.get("/api/v1/sources").json()["items"]
        assert said in source["error"]
        for path in ("/", "/?building=TOWER", "/buildings/TOWER/recordings"):
            page = asking.get(path).text
            assert said in page
            assert "t0ken" not in page


@pytest.fixture
def server() -> Iterator[Server]:
    from monitoring import serving

    with serving() as made:
        yield made


WHOLE = miniseed(stream())


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
