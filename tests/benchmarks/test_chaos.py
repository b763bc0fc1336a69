"""The comparison after kills finds what was lost, doubled, stuck or left, and nothing else."""

import json
import sys
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path
from subprocess import PIPE, STDOUT

import databases
import psutil
import pytest
from monitoring_server import START, building_file, miniseed, stream
from processes import kill_tree
from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from benchmarks.chaos_comparison import differences, outcome
from service.alerts.tables import Alert
from service.analyses.tables import Analysis
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.buildings.tables import Building
from service.db.sessions import sessions
from service.jobs.tables import Job
from service.notify.outbox import MessageContent, put
from service.notify.tables import Delivery, DeliveryAttempt, Message
from service.records.ingest import ingest
from service.records.tables import Event, EventRecording, Waveform
from service.settings import Settings

ROOT = Path(__file__).resolve().parents[2]
NOW = START + timedelta(days=1)
KILLS = 4


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """A database after two earthquakes with their results, messages and an alert."""
    opened = sessions(databases.sqlite(tmp_path_factory.mktemp("finished")))
    with opened() as session:
        building = building_store.add(session, building_file(), Path("/"), NOW)
        rule = ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES)
        recipients.add(session, building.id, rule, "engineer", NOW)
        for number in range(2):
            data = miniseed(stream(START + timedelta(hours=number), 20, seed=number))
            ingest(session, building, f"{number}.mseed", f"/{number}", data, NOW, settings=Settings())
        session.flush()
        for job in session.scalars(select(Job)).all():
            job.state = "done"
            session.add(analysis(job.event_id, job.id))
            put(session, MessageContent(f"event/{job.event_id}", building.id, "event", "new", "note", "A", ("B",)), NOW)
        session.add(alert(building.id))
        session.execute(update(Delivery).values(state="delivered"))
        session.commit()
        yield session
    opened.kw["bind"].dispose()


def analysis(event: int | None, job: int, is_current: bool = True, pga: float = 0.1) -> Analysis:
    kept = {"event_id": event, "job_id": job, "revision_id": 1, "created_at": NOW, "version": "1", "settings": {}}
    return Analysis(**kept, current=is_current, inputs=["a"], quality=[], peaks={"c": 0.1}, pga=pga)


def alert(building: int) -> Alert:
    kept = {"building_id": building, "cause": "source", "kind": "data", "state": "active", "summary": "A"}
    lists = {"event_ids": [], "channels": [], "evidence": {}, "sentences": []}
    return Alert(**kept, **lists, began_at=NOW, opened_at=NOW, updated_at=NOW)


def test_equal_runs_do_not_differ(finished: Session) -> None:
    found = outcome(finished)
    parts = (found.recordings, found.events, found.analyses, found.alerts, found.messages)
    assert [part.total() for part in parts] == [2, 2, 2, 1, 2]
    received = {"email": {one: [False, True] for one in found.outbox["email"]}}
    assert not list(differences(found, found, received, []))


def lost_event(session: Session) -> None:
    for table in (Waveform, EventRecording):
        session.execute(delete(table).where(table.event_id == 1))
    session.execute(delete(Analysis).where(Analysis.event_id == 1))
    session.execute(update(Job).where(Job.event_id == 1).values(event_id=2))
    session.delete(session.get_one(Event, 1))


def doubled_event(session: Session) -> None:
    one = session.get_one(Event, 1)
    kept = {"building_id": one.building_id, "start": one.start, "end": one.end, "state": one.state}
    session.add(Event(**kept, created_at=NOW, updated_at=NOW))


def superseded(session: Session) -> None:
    session.execute(update(Analysis).where(Analysis.event_id == 1).values(current=False))


def another_result(session: Session) -> None:
    session.execute(update(Analysis).where(Analysis.event_id == 1).values(pga=0.2))


def doubled_alert(session: Session) -> None:
    session.execute(update(Alert).values(closed_at=NOW))
    session.add(alert(session.scalars(select(Building.id)).one()))


def lost_message(session: Session) -> None:
    session.execute(delete(DeliveryAttempt))
    session.execute(delete(Delivery).where(Delivery.message_id == 1))
    session.execute(delete(Message).where(Message.id == 1))


def stuck_job(session: Session) -> None:
    session.execute(update(Job).where(Job.id == 1).values(state="running"))


def stuck_delivery(session: Session) -> None:
    session.execute(update(Delivery).where(Delivery.id == 1).values(state="sending"))


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        (lost_event, ["lost events", "lost analyses", "lost messages", "doubled messages"]),
        (doubled_event, ["doubled events"]),
        (superseded, ["lost analyses"]),
        (another_result, ["lost analyses", "doubled analyses"]),
        (doubled_alert, ["doubled alerts"]),
        (lost_message, ["lost messages"]),
        (stuck_job, ["stuck job 1 (analyse) is running"]),
        (stuck_delivery, ["stuck delivery 1 is sending after 0 attempts"]),
    ],
)
def test_a_difference_is_found(finished: Session, change: Callable[[Session], None], wanted: list[str]) -> None:
    calm = outcome(finished)
    change(finished)
    try:
        finished.flush()
        chaos = outcome(finished)
    finally:
        finished.rollback()
    received = {kind: {one: [False] for one in identities} for kind, identities in chaos.outbox.items()}
    found = [f"{one.kind} {one.subject.split(':')[0]}" for one in differences(calm, chaos, received, [])]
    assert found == wanted


@pytest.mark.parametrize(
    ("repeats", "wanted"),
    [
        (None, "lost email: {}"),
        ([False, False], "doubled email: {} came again and did not say so"),
        ([False, True, False], "doubled email: {} came again and did not say so"),
    ],
)
def test_what_recipients_got_is_compared(finished: Session, repeats: list[bool] | None, wanted: str) -> None:
    run = outcome(finished)
    first, second = sorted(run.outbox["email"])
    received = {"email": {second: [False]} | ({} if repeats is None else {first: repeats})}
    assert [f"{one.kind} {one.subject}" for one in differences(run, run, received, [])] == [wanted.format(first)]


def test_what_nobody_sent_and_a_process_that_is_left_are_found(finished: Session) -> None:
    run = outcome(finished)
    received = {"email": {one: [False] for one in (*run.outbox["email"], "msg_strange")}}
    found = [f"{one.kind} {one.subject}" for one in differences(run, run, received, ["process 7"])]
    assert found == ["doubled email: msg_strange is no message", "left process 7"]


@pytest.mark.slow
def test_a_few_kills_lose_nothing(tmp_path: Path) -> None:
    """The benchmark itself, from its servers to the report; it takes up to a minute, mostly waiting."""
    output = tmp_path / "result.json"
    asked = ("--kills", str(KILLS), "--minutes", "1", "--output", output)
    run = psutil.Popen([sys.executable, "-m", "benchmarks.chaos", *asked], cwd=ROOT, stdout=PIPE, stderr=STDOUT)
    try:
        printed = run.communicate(timeout=600)[0].decode()
    finally:
        kill_tree(run)
    assert run.returncode == 0, printed
    found = json.loads(output.read_text())
    assert found["database"] == "sqlite"
    assert found["differences"] == []
    assert 1 <= sum(found["kills"].values()) <= KILLS, "fewer on a machine with other work"
    counts = {name: (calm, chaos) for name, calm, chaos in found["rows"]}
    assert counts["events"] == counts["analyses"] == ("16", "16")
