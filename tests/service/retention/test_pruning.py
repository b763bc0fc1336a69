"""Each kind goes after its period, and what something refers to stays."""

from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path

import pytest
import stored_histories
from api_client import client
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker

from service.access.tables import AuditEntry
from service.alerts.tables import Alert, BuildingInspection
from service.analyses.tables import DELETED, Analysis, DirectionResult
from service.drift.tables import DriftValue, MonitoredSeries
from service.errors import NotFoundError
from service.jobs import requests
from service.jobs.tables import Job
from service.models.tables import ModelComparison, ModelVersion
from service.notify.tables import Delivery, DeliveryAttempt, Message, Receiver
from service.records import originals
from service.records.originals import DeletedFileError
from service.records.tables import Content, Event, EventRecording, Packet, Recording
from service.retention import pruning
from service.settings import Settings
from service.settings.groups import Storage

DAY = timedelta(days=1)
NOW = stored_histories.start(40)
LATER = NOW + 100 * DAY
MONTH = 30 * 86_400.0
FILES = Settings(retention={"original_files": MONTH})
EVENTS = 8


@pytest.fixture
def events(sessions: sessionmaker[Session]) -> list[int]:
    """Numbers of eight analysed earthquakes of one building, each with an original file of its own."""
    with sessions.begin() as session:
        building = stored_histories.building(session).id
    stored_histories.store_and_monitor(sessions, building, stored_histories.store_history(EVENTS), NOW)
    with sessions.begin() as session:
        numbers = list(session.scalars(select(Event.id).order_by(Event.start)))
        for number in numbers:
            with_file(session, building, data(number), event=number)
    return numbers


def data(number: int) -> bytes:
    return b"original file of %d" % number


def with_file(session: Session, building: int, content: bytes, event: int | None = None, **columns: object) -> None:
    """An original file of a building."""
    one = originals.secured(content, Storage())
    originals.add(session, one)
    usual = {"name": "a.mseed", "origin": "/a", "received_at": NOW, "kind": "waveforms", "state": "read"}
    row = Recording(building_id=building, sha256=one.sha256, **(usual | columns))
    session.add(row)
    session.flush()
    if event is not None:
        session.add(EventRecording(event_id=event, recording_id=row.id))


def there(sessions: sessionmaker[Session]) -> set[bytes]:
    """The original files that can still be read."""
    with sessions() as session:
        digests = session.scalars(select(Content.sha256).where(originals.is_there()))
        return {originals.read(session, one, Storage()) for one in digests}


def kept(sessions: sessionmaker[Session], kind: str, settings: Settings) -> Mapping[str, int]:
    with sessions() as session:
        (found,) = (one for one in pruning.prunable(session, settings, LATER) if one.kind.startswith(kind))
        return found.kept


def of_alert(session: Session, building: int, event: int) -> None:
    texts = {"cause": "stiffness", "kind": "stiffness", "state": "resolved", "summary": "softer"}
    times = {"began_at": NOW, "opened_at": NOW, "updated_at": NOW, "closed_at": NOW}
    lists: dict[str, list[object]] = {"channels": [], "sentences": []}
    session.add(Alert(building_id=building, event_ids=[event], evidence={}, **texts, **times, **lists))


def of_baseline(session: Session, building: int, event: int) -> None:
    job = session.scalars(select(Job.id).limit(1)).one()
    made = {"created_at": NOW, "version": "test", "job_id": job, "wanted": 0}
    series = MonitoredSeries(building_id=building, quantity="test", subject="x", **made)
    flags = {"is_reference": True, "is_beyond": False, "is_excluded": False}
    session.add(DriftValue(series=series, event_id=event, value=0.0, std=1.0, count=1, causes=[], **flags))


def of_model(session: Session, building: int, event: int) -> None:
    analysis = session.scalars(select(Analysis).where(Analysis.event_id == event)).one()
    made = {"created_at": NOW, "version": "test"}
    empty = {"effects": {}, "standard_deviations": {}, "assumed": [], "state": "current", "change": "", "author": "Jo"}
    model = ModelVersion(
        building_id=building, revision_id=analysis.revision_id, direction="x", number=1, **empty, **made
    )
    of_event = {"event_id": event, "analysis_id": analysis.id, "direction": "x", "role": "fitted"}
    session.add(ModelComparison(model=model, misfit={}, force=b"", **of_event, **made))


def of_inspection(session: Session, building: int, event: int) -> None:
    at = session.get_one(Event, event).start + timedelta(hours=1)
    said = {"by": "Jo", "result": "fit", "comment": "seen", "level": "normal", "headline": "Normal"}
    session.add(BuildingInspection(building_id=building, inspected_at=at, recorded_at=at, **said))


@pytest.mark.parametrize(
    ("reason", "refer"),
    [
        ("an alert refers to its earthquake", of_alert),
        ("a baseline refers to its earthquake", of_baseline),
        ("a current model refers to its earthquake", of_model),
        ("an inspection refers to its earthquake", of_inspection),
    ],
)
def test_original_files_go_unless_something_refers_to_their_earthquake(
    sessions: sessionmaker[Session], events: list[int], reason: str, refer: Callable[[Session, int, int], None]
) -> None:
    referred = [events[1], events[-1]]  # the last one by the verdict
    with sessions.begin() as session:
        session.query(DriftValue).delete()  # of the monitoring itself
        building = session.get_one(Event, events[0]).building_id
        refer(session, building, events[1])
        with_file(session, building, b"station", kind="station")
        with_file(session, building, b"not read", state="stored")
        with_file(session, building, b"failed", state="refused", failures=3)
        with_file(session, building, b"young", received_at=LATER - DAY)
        with_file(session, building, b"rejected", state="refused", reason="no records")
    said = kept(sessions, "original", FILES)
    assert said[reason] == 1
    assert said["a verdict refers to its earthquake"] == 1
    pruning.prune(sessions, Settings(), LATER)
    assert len(there(sessions)) == EVENTS + 5
    pruning.prune(sessions, FILES, LATER)
    assert there(sessions) == {*map(data, referred), b"station", b"not read", b"failed", b"young"}


def test_a_result_says_when_and_by_which_rule_its_file_was_deleted(
    sessions: sessionmaker[Session], events: list[int], database_url: str
) -> None:
    digest = sha256(data(events[0])).hexdigest()
    with sessions.begin() as session:
        session.query(DriftValue).delete()
        analysis = session.scalars(select(Analysis).where(Analysis.event_id == events[0])).one()
        analysis.inputs = [digest]
    pruning.prune(sessions, FILES, LATER)
    said = f"deleted on {LATER:%Y-%m-%d} by retention.original_files"
    with sessions() as session, pytest.raises(DeletedFileError, match=said):
        originals.read(session, digest, Storage())
    with client(database_url) as api:
        assert said in api.get(f"/events/{events[0]}").text
        listed = api.get("/api/v1/recordings").json()["items"]
        assert {one["deleted_by"] for one in listed} == {"retention.original_files", None}
        building = api.get("/api/v1/buildings").json()["items"][0]["code"]
        assert said in api.get(f"/buildings/{building}/recordings").text


def test_a_deleted_file_that_comes_again_is_there_again(sessions: sessionmaker[Session], events: list[int]) -> None:
    with sessions.begin() as session:
        session.query(DriftValue).delete()
    pruning.prune(sessions, FILES, LATER)
    assert data(events[0]) not in there(sessions)
    with sessions.begin() as session:
        originals.add(session, originals.secured(data(events[0]), Storage()))
    assert data(events[0]) in there(sessions)


def test_files_in_a_store_are_deleted_there_too(
    sessions: sessionmaker[Session], events: list[int], tmp_path: Path
) -> None:
    storage = {"originals": f"file://{tmp_path}"}
    originals.move(sessions, Storage(**storage), lambda *_: None, to_store=True)
    with sessions.begin() as session:
        session.query(DriftValue).delete()
    settings = Settings(retention={"original_files": MONTH}, storage=storage)
    pruning.prune(sessions, settings, LATER)
    assert [one.name for one in tmp_path.glob("*/*")] == [sha256(data(events[-1])).hexdigest()]
    with sessions() as session:
        assert session.scalar(select(func.count()).where(Content.is_outside)) == 1


def test_jobs_go_that_nothing_is_from(sessions: sessionmaker[Session], events: list[int]) -> None:
    settings = Settings(retention={"jobs": MONTH})
    with sessions.begin() as session:
        for one in session.scalars(select(Job)):
            one.state, one.finished_at = "done", NOW
        building = session.get_one(Event, events[0]).building_id
        usual = {"kind": "sensors", "building_id": building, "arguments": {}, "created_at": NOW}
        old = Job(state="done", result={"much": "x" * 1000}, finished_at=NOW, **usual)
        last, waits = Job(state="done", finished_at=NOW, **usual), Job(state="waiting", **usual)
        session.add_all([old, last, waits])
        session.flush()
        numbers = {one.id for one in (last, waits)}
        needed = {*session.scalars(select(Analysis.job_id)), *session.scalars(select(MonitoredSeries.job_id))}
        session.flush()
    pruning.prune(sessions, settings, LATER)
    with sessions() as session:
        left = set(session.scalars(select(Job.id)))
        with pytest.raises(NotFoundError, match=r"retention\.jobs is set"):
            requests.job(session, old.id)
    assert old.id not in left
    assert needed <= left
    assert waits.id in numbers & left


def test_messages_go_that_later_ones_followed(sessions: sessionmaker[Session], events: list[int]) -> None:
    settings = Settings(retention={"messages": MONTH})
    with sessions.begin() as session:
        building = session.get_one(Event, events[0]).building_id
        of_alert(session, building, events[0])
        session.flush()
        alert = session.scalars(select(Alert)).one()
        alert.closed_at = None
        usual = {"building_id": building, "kind": "event", "sequence": "new", "severity": "note", "is_over": True}
        texts = {"subject": "A", "sentences": ["B"], "facts": [], "link": "/", "data": {}, "digest": "0"}
        receiver = Receiver(
            building_id=building,
            name="desk",
            kind="email",
            address="a@example.org",
            kinds=[],
            severities=[],
            origin="api",
            created_at=NOW,
        )
        for key, state in (("event/1", "delivered"), ("event/2", "waiting"), (f"alert/{alert.id}", "delivered")):
            for number in (1, 2):
                row = Message(identity=f"{key}-{number}", key=key, number=number, created_at=NOW, **usual, **texts)
                delivery = Delivery(message=row, receiver=receiver, state=state, due_at=NOW, created_at=NOW)
                attempt = {"number": 1, "is_repeat": False, "address": "desk", "begun_at": NOW}
                session.add(DeliveryAttempt(delivery=delivery, **attempt))
        names = {"event/1-2", "event/2-1", "event/2-2", f"alert/{alert.id}-1", f"alert/{alert.id}-2"}
    pruning.prune(sessions, settings, LATER)
    with sessions() as session:
        assert set(session.scalars(select(Message.identity))) == names
        assert session.scalar(select(func.count()).select_from(DeliveryAttempt)) == len(names)


def test_packets_and_entries_go_by_their_age(sessions: sessionmaker[Session], events: list[int]) -> None:
    settings = Settings(retention={"audit_trail": MONTH})

    def add(session: Session, at: datetime, name: str) -> None:
        place = {"station": "XX_A", "channel": "HNX", "start": at, "end": at, "received_at": at, "sha256": name}
        session.add(Packet(building_id=1, data=b"packet", **place))
        session.add(AuditEntry(at=at, by=name, address="", action="", target="", details={}))

    with sessions.begin() as session:
        for name, at in (("old", NOW), ("young", LATER)):
            add(session, at, name)
            session.flush()
    pruning.prune(sessions, settings, LATER)
    with sessions() as session:
        assert session.scalars(select(Packet.sha256)).all() == ["young"]
        assert session.scalars(select(AuditEntry.by)).all() == ["young"]


def rows_by_kind(session: Session) -> dict[str, int]:
    """Rows of each kind that are still there; of histories and analyses also the current ones."""
    has_force = func.length(DirectionResult.force) > len(DELETED)
    tables = {
        "superseded analyses": Analysis,
        "jobs and their results": Job,
        "messages that later ones followed": Message,
        "packets of live streams": Packet,
        "entries of the audit trail": AuditEntry,
    }
    of_histories = select(func.count(DirectionResult.analysis_id.distinct())).where(has_force)
    of_files = select(func.count(Content.sha256)).where(originals.is_there())
    return {
        "histories of superseded analyses": session.execute(of_histories).scalar_one(),
        "original files": session.execute(of_files).scalar_one(),
        **{kind: session.execute(select(func.count(table.id))).scalar_one() for kind, table in tables.items()},
    }


def test_a_dry_run_counts_what_is_then_deleted_of_every_kind(
    sessions: sessionmaker[Session], events: list[int]
) -> None:
    """Both rules at once: a deleted analysis keeps its job, and its histories are a kind of their own."""
    ages = ("superseded_histories", "original_files", "jobs", "messages", "audit_trail")
    settings = Settings(retention=dict.fromkeys(ages, MONTH) | {"superseded_analyses": 2 * MONTH})
    with sessions() as session:
        building = session.get_one(Event, events[0]).building_id
    stored_histories.store_and_monitor(sessions, building, stored_histories.store_history(3), NOW + DAY)
    message = {"kind": "event", "sequence": "new", "severity": "note", "is_over": True, "subject": "A", "link": "/"}
    lists = {"sentences": ["B"], "facts": [], "data": {}, "digest": "0"}
    place = {"building_id": building, "station": "XX_A", "channel": "HNX", "data": b"packet"}
    with sessions.begin() as session:
        superseded = session.scalars(select(Analysis).where(~Analysis.current)).all()
        superseded[0].created_at = LATER - timedelta(seconds=1.5 * MONTH)
        for job in session.scalars(select(Job)):
            job.state, job.finished_at = "done", NOW
        for number in range(pruning.AT_ONCE + 2):
            one = {"identity": f"a-{number}", "key": "a", "number": number, "created_at": NOW}
            session.add(Message(building_id=building, **one, **message, **lists))
            session.add(AuditEntry(at=NOW, by="Jo", address="", action="", target="", details={}))
            at = NOW + timedelta(seconds=number)
            session.add(Packet(**place, start=at, end=at, received_at=at, sha256=str(number)))
    with sessions() as session:
        before, would = rows_by_kind(session), pruning.prunable(session, settings, LATER)
    are = pruning.prune(sessions, settings, LATER)
    with sessions() as session:
        after = rows_by_kind(session)
    assert all(one.rows > 0 for one in would), "every kind is tried"
    assert are == would
    assert {kind: before[kind] - after[kind] for kind in before} == {one.kind: one.rows for one in would}
