"""A building is exported from one installation and imported into another: its answers are the same there."""

from io import BytesIO
from pathlib import Path
from shutil import copyfile
from typing import Any

import databases
import monitored_building
import pytest
from alert_candidates import softer_isolators, stopped_data
from alert_fixtures import with_stored_events
from api_client import client
from click.testing import Result
from exports import Edit, add, edited, entries, number_of_rows, put
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session, sessionmaker, undefer
from typer.testing import CliRunner

from service.access.tables import AuditEntry
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.buildings.store import BuildingError
from service.buildings.tables import Building
from service.cli import app
from service.db import sessions as opened
from service.db.base import Base
from service.db.migrate import newest
from service.jobs.tables import Job
from service.models.tables import ModelVersion
from service.notify.tables import Delivery, DeliveryAttempt, Message, Receiver
from service.records import originals
from service.records.tables import Content, Event, Packet, StreamState
from service.settings.groups import Storage
from service.transfer import archive, contents
from service.transfer.archive import MANIFEST, ArchiveError
from service.transfer.exporting import export
from service.transfer.importing import import_building

NOW = monitored_building.NOW
AGE = monitored_building.APART * 100
SECRET = "whsec_" + "c2VjcmV0" * 4
HOOK = "https://example.org/hook/s3cret"
RECEIVER = f'\n[[receiver]]\nname = "desk"\nkind = "webhook"\naddress = "{HOOK}"\nsecret = "{SECRET}"\n'

IN_DATABASE = Storage()


def silent(doing: str, done: int, of: int) -> None:
    assert 0 < done <= of, doing


@pytest.fixture(scope="module")
def in_use(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An SQLite file with the paper's building: two analysed earthquakes and an unusable file, a model and its
    comparison, an alert with a comment, messages, a live stream, and work that is under way."""
    folder = tmp_path_factory.mktemp("in_use")
    sessions = opened.sessions(databases.sqlite(folder))
    records = folder / "records"
    records.mkdir()
    monitored_building.watch(sessions, records, [*monitored_building.earthquakes()[1:3], b"no records"])
    with sessions.begin() as session:
        text = monitored_building.building_file(records) + RECEIVER
        building_store.update_description(session, text, records, NOW)
    with client(f"sqlite:///{folder / 'menshin.sqlite'}") as api:
        assert api.post("/api/v1/buildings/PAPER/models", json={"direction": "x"}).status_code == 201
        assert api.post("/api/v1/models/1/comparisons", json={"events": [1, 2]}).status_code == 202
    monitored_building.work(sessions)
    with sessions.begin() as session:
        events = session.scalars(select(Event.id).order_by(Event.start)).all()
        reconcile(session, 1, [with_stored_events(softer_isolators(8.0), (*events, events[-1]))], "events", NOW)
        reconcile(session, 1, [stopped_data()], "clock", NOW)
        session.flush()
        write_messages(session, 1, AGE, NOW)
        session.execute(update(Delivery).values(state="delivered", finished_at=NOW))
        attempt = {"number": 1, "is_repeat": False, "address": "https://example.org", "begun_at": NOW}
        session.add(DeliveryAttempt(delivery=session.scalars(select(Delivery).limit(1)).one(), **attempt))
        packet = {"station": "XX_A", "channel": "HNX", "start": NOW, "end": NOW, "received_at": NOW, "sha256": "0" * 64}
        session.add(Packet(building_id=1, id=7, data=b"packet", **packet))
        cut = {"start": NOW.isoformat(), "end": NOW.isoformat(), "upto": 7, "late_since": None}
        counted = {"packets": 1, "doubles": 0, "refused": 0, "channels": {}, "shaking": []}
        session.add(StreamState(building_id=1, looked=7, cuts=[cut], **counted))
        session.add(Job(kind="watch", building_id=1, arguments={}, state="running", claimed_until=NOW, created_at=NOW))
    with client(f"sqlite:///{folder / 'menshin.sqlite'}") as api:
        assert api.post("/api/v1/alerts/1/comments", json={"text": "seen"}).status_code in (200, 201)
    sessions.kw["bind"].dispose()
    return folder / "menshin.sqlite"


def exported(sessions: sessionmaker[Session], *, with_secrets: bool = True, storage: Storage = IN_DATABASE) -> bytes:
    """An export as bytes."""
    file = BytesIO()
    with opened.reading(sessions)() as session:
        export(session, "PAPER", file, NOW, silent, with_secrets=with_secrets, settings=storage)
    return file.getvalue()


@pytest.fixture(scope="module")
def whole(in_use: Path) -> bytes:
    """The building's export, with its secrets."""
    sessions = opened.sessions(f"sqlite:///{in_use}")
    try:
        return exported(sessions)
    finally:
        sessions.kw["bind"].dispose()


def imported(sessions: sessionmaker[Session], data: bytes, folder: Path, storage: Storage = IN_DATABASE) -> None:
    """Import an export."""
    file = folder / "building.zip"
    file.write_bytes(data)
    with archive.opened(file, newest(), {one.name: one for one in contents.expected()}) as found:
        import_building(sessions, found, silent, storage)


def answers(url: str) -> dict[str, Any]:
    """Answers of the API about the building, by path."""
    found: dict[str, Any] = {}
    with client(url) as api:

        def ask(path: str) -> Any:  # noqa: ANN401  any JSON
            answer = api.get(path)
            assert answer.status_code == 200, (path, answer.text)
            found[path] = answer.json() if answer.headers["content-type"] == "application/json" else answer.content
            return found[path]

        building = "/api/v1/buildings/PAPER"
        for name in ("", "/baseline", "/drift", "/equivalent", "/modes", "/receivers", "/silences", "/watched"):
            ask(building + name)
        for event in (1, 2):
            ask(f"/api/v1/events/{event}")
            ask(f"/api/v1/events/{event}/restoring-force?direction=x")
            ask(f"/api/v1/events/{event}/waveforms/{monitored_building.BASE}")
        for one in ask("/api/v1/alerts?building=PAPER")["items"]:
            ask(f"/api/v1/alerts/{one['id']}")
        for one in ask(f"{building}/messages")["items"]:
            ask(f"/api/v1/messages/{one['id']}")
        for one in ask(f"{building}/models")["items"]:
            assert ask(f"/api/v1/models/{one['id']}/comparisons")["items"]
        ask("/api/v1/recordings?building=PAPER")
        ask("/fdsnws/dataselect/1/query?net=XX&sta=PAPER&start=2000-01-01&end=2030-01-01")
    return found


def test_an_imported_building_answers_as_before_and_goes_back_as_it_was(
    whole: bytes, in_use: Path, tmp_path: Path, sessions: sessionmaker[Session], database_url: str
) -> None:
    imported(sessions, whole, tmp_path)
    assert answers(database_url) == answers(f"sqlite:///{in_use}")
    again = entries(exported(sessions))
    assert again == entries(whole), "every row, every file and the manifest"
    with sessions.begin() as session:
        last = session.scalar(select(func.max(Event.id)))
        session.add(Event(building_id=1, start=NOW, end=NOW, state="queued", created_at=NOW, updated_at=NOW))
        session.flush()
        assert session.scalar(select(func.max(Event.id))) > last, "numbers go on after the imported ones"


def test_numbers_that_are_in_use_are_shifted_wherever_they_stand(
    whole: bytes, in_use: Path, tmp_path: Path, sessions: sessionmaker[Session], database_url: str
) -> None:
    imported(sessions, whole, tmp_path)
    with sessions.begin() as session:  # the same rows with other names: the building is another one's now
        session.execute(update(Building).values(code="OTHER"))
        session.execute(update(Message).values(identity=Message.identity + "_"))
    imported(sessions, whole, tmp_path)
    with sessions() as session:
        other, mine = session.scalars(select(Building.id).order_by(Building.id))
        of_mine = {
            table: session.scalars(select(table.id).where(table.building_id == mine).order_by(table.id)).all()
            for table in (Event, Alert, Message, ModelVersion, Packet)
        }
        events, (alert, second), [model], [packet] = (of_mine[one] for one in (Event, Alert, ModelVersion, Packet))
        assert min(events) > max(session.scalars(select(Event.id).where(Event.building_id == other)))
        found = session.get_one(Alert, alert)
        assert found.event_ids == list(events)
        stream = session.get_one(StreamState, mine)
        assert (stream.looked, stream.cuts[0]["upto"]) == (packet, packet)
        [compared] = session.scalars(select(Job).where(Job.kind == "compare", Job.model_id == model))
        assert compared.arguments == {"events": list(events)}
        messages = session.scalars(select(Message).where(Message.building_id == mine)).all()
        about = {f"event/{one}": f"/events/{one}" for one in events} | {f"alert/{second}": f"/alerts/{second}"}
        assert {one.key for one in messages} == set(about)
        for one in messages:
            named = [told["id"] for told in one.data.get("alerts", ())]
            assert set(named) <= {alert}
            assert one.link == (f"/alerts/{alert}" if named else about[one.key])
            assert [fact["name"] for fact in one.facts if "Alert" in fact["name"]] == [f"Alert {alert}" for _ in named]
        assert sum(bool(one.data.get("alerts")) for one in messages) == 1
        count = session.scalar(select(func.count(Message.id)))
    with sessions.begin() as session:
        write_messages(session, mine, AGE, NOW)
        assert session.scalar(select(func.count(Message.id))) == count, "what was reported is no news here"
    with client(database_url) as api:
        assert api.get(f"/api/v1/events/{events[0]}").json()["building"] == "PAPER"
        assert api.get(f"/alerts/{alert}").status_code == 200


@pytest.fixture
def store(tmp_path: Path) -> tuple[Storage, Path]:
    """Settings that keep original files in a folder, and the folder."""
    folder = tmp_path / "originals"
    folder.mkdir()
    return Storage(originals=f"file://{folder}"), folder


def in_store(folder: Path) -> dict[str, bytes]:
    """The files of a store by their paths in it."""
    return {str(one.relative_to(folder)): one.read_bytes() for one in folder.rglob("*") if one.is_file()}


def original_files(data: bytes) -> dict[str, bytes]:
    """The original files of an export by the paths that a store gives them."""
    found = {name.removeprefix("files/"): file for name, file in entries(data).items() if name.startswith("files/")}
    return {f"{digest[:2]}/{digest}": file for digest, file in found.items()}


@pytest.mark.sqlite
def test_original_files_move_from_a_database_into_a_store_and_back(
    whole: bytes, tmp_path: Path, store: tuple[Storage, Path], sessions: sessionmaker[Session]
) -> None:
    storage, folder = store
    imported(sessions, whole, tmp_path, storage)
    assert in_store(folder) == original_files(whole), "under their own names, byte for byte"
    with sessions() as session:
        rows = session.execute(select(Content.is_outside, func.length(Content.data))).all()
    assert set(rows) == {(True, 0)}, "nothing of them is in the database"
    assert len(rows) == 3
    assert (originals.check(sessions, storage, silent), originals.unknown(sessions, storage)) == ([], [])

    from_store = exported(sessions, storage=storage)
    assert entries(from_store) == entries(whole)
    (tmp_path / "back").mkdir()
    back = opened.sessions(databases.sqlite(tmp_path / "back"))
    imported(back, from_store, tmp_path)
    with back() as session:
        kept = {one.sha256: one.data for one in session.scalars(select(Content).options(undefer(Content.data)))}
        assert session.scalar(select(func.count()).where(Content.is_outside)) == 0
    assert {f"{digest[:2]}/{digest}": data for digest, data in kept.items()} == original_files(whole)
    assert entries(exported(back)) == entries(whole)
    back.kw["bind"].dispose()


@pytest.mark.sqlite
def test_an_import_that_fails_leaves_no_rows_and_its_files_are_named_until_one_succeeds(
    whole: bytes,
    tmp_path: Path,
    store: tuple[Storage, Path],
    sessions: sessionmaker[Session],
    database_url: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    storage, folder = store
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    monkeypatch.setenv("MENSHIN_STORAGE__ORIGINALS", str(storage.originals))

    def checked() -> list[str]:
        done = CliRunner().invoke(app, ["storage", "check"])
        assert done.exit_code == 0, done.output
        return done.stdout.splitlines()

    small = edited(whole, without_series)
    names = sorted(path.rpartition("/")[2] for path in original_files(whole))
    for change, reason in (
        (put("tables/mode_result.jsonl", "id", 1), "it contradicts itself"),
        (lambda members: members.update({f"files/{names[-1]}": b"!"}), "does not match its name"),
    ):
        with pytest.raises(ArchiveError, match=reason):
            imported(sessions, edited(small, change), tmp_path, storage)
        assert number_of_rows(sessions) == 0
        left = sorted(path.rpartition("/")[2] for path in in_store(folder))
        assert set(left) <= set(names)
        *named, said, last = checked()
        assert named == left
        assert said.startswith(f"Files in the store that belong to nothing in this database: {len(left)}.")
        assert last.startswith("0 original files in the store are whole")
    imported(sessions, small, tmp_path, storage)
    assert [line.partition(",")[0] for line in checked()] == ["3 original files in the store are whole"]
    assert in_store(folder) == original_files(whole)


@pytest.mark.sqlite
def test_what_is_under_way_stays_where_it_is(in_use: Path, tmp_path: Path, sessions: sessionmaker[Session]) -> None:
    copyfile(in_use, tmp_path / "home.sqlite")
    at_home = opened.sessions(f"sqlite:///{tmp_path / 'home.sqlite'}")
    with at_home.begin() as session:
        waiting = session.scalars(select(Delivery).order_by(Delivery.id.desc()).limit(1)).one()
        waiting.state, waiting.finished_at = "waiting", None
        left = session.query(Delivery).count() - 1
    imported(sessions, exported(at_home), tmp_path)
    at_home.kw["bind"].dispose()
    with sessions() as session:
        assert [one.state for one in session.query(Delivery)] == ["delivered"] * left, "nobody gets a message twice"
        [watch] = session.scalars(select(Job).where(Job.kind == "watch", Job.finished_at.is_(None)))
        assert (watch.state, watch.claimed_until) == ("waiting", None), "no worker of this installation has it"


@pytest.mark.sqlite
def test_secrets_stay_at_home(
    whole: bytes, in_use: Path, tmp_path: Path, sessions: sessionmaker[Session], database_url: str
) -> None:
    at_home = opened.sessions(f"sqlite:///{in_use}")
    without = exported(at_home, with_secrets=False)
    at_home.kw["bind"].dispose()
    for secret in (SECRET, "s3cret"):
        assert any(secret.encode() in one for one in entries(whole).values())
        assert not any(secret.encode() in one for one in entries(without).values())
    imported(sessions, without, tmp_path)
    with sessions.begin() as session:
        [desk] = session.query(Receiver)
        assert (desk.secret, desk.address) == (None, "https://example.org/…")
        assert desk.removed_at is not None, "nothing is sent to half an address"
    with client(database_url) as api:
        assert api.get("/buildings/PAPER").status_code == 200
    with sessions.begin() as session:
        complete = monitored_building.building_file(tmp_path) + RECEIVER
        building_store.update_description(session, complete, tmp_path, NOW)
        assert (desk := session.query(Receiver).one()).removed_at is None
        assert desk.address == HOOK


@pytest.mark.sqlite
def test_a_secret_that_cannot_be_left_out_stops_the_export(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    with sessions.begin() as session:
        escaped = RECEIVER.replace("whsec_", "whsec\\u005f")
        building_store.add(session, monitored_building.building_file(tmp_path) + escaped, tmp_path, NOW)
    with pytest.raises(BuildingError, match="revision 1 of the description has a secret that is written with escapes"):
        exported(sessions, with_secrets=False)


@pytest.mark.sqlite
def test_a_building_that_exists_is_not_touched(whole: bytes, tmp_path: Path, sessions: sessionmaker[Session]) -> None:
    imported(sessions, whole, tmp_path)
    before = entries(exported(sessions))
    with pytest.raises(BuildingError, match="'PAPER' already exists here"):
        imported(sessions, whole, tmp_path)
    assert entries(exported(sessions)) == before


REFUSED: dict[str, tuple[Edit, str]] = {
    "a path outside": (add("../../etc/cron.d/menshin", b""), r"not an export of a building: it has '\.\./\.\./etc"),
    "an absolute path": (add("/etc/passwd", b""), "it has '/etc/passwd'"),
    "a bomb": (
        add("files/" + "0" * 64, bytes(200 * 2**20)),
        "would unpack to 21. MB, more than 100 times its size",
    ),
    "no manifest": (
        lambda members: members.update({MANIFEST: {"tables": members[MANIFEST]["tables"]}}),
        "format 'None'",
    ),
    "another format": (put(MANIFEST, "format", "zip"), "format 'zip' instead of 'menshin-building'"),
    "a later version": (put(MANIFEST, "version", 2), "it has version 2 of the format, and this Menshin reads 1"),
    "another database": (put(MANIFEST, "revision", "0099_future"), "revision '0099_future'"),
    "another building": (put(MANIFEST, "building", "TOWER"), "its building is not 'TOWER', as its manifest says"),
    "a missing table": (lambda members: members.pop("tables/alert.jsonl"), "table alert is missing"),
    "a foreign table": (add("tables/api_key.jsonl", b""), "table api_key is missing, or is not a table of an export"),
    "fewer rows": (
        lambda members: members["tables/mode_result.jsonl"].pop(),
        "is not the one that the manifest",
    ),
    "other bytes": (lambda members: members.update({first_file(members): b"!"}), "does not match its name"),
    "a missing file": (lambda members: members.pop(first_file(members)), "its manifest says"),
    "another building's row": (
        put("tables/event.jsonl", "building_id", 2),
        "refers to building 2, which",
    ),
    "a lost parent": (put("tables/mode_result.jsonl", "result_id", 999), "refers to direction_result 999"),
    "a missing value": (put("tables/event.jsonl", "state", None), "event.state is missing"),
    "a text for a number": (put("tables/event.jsonl", "recorded_peak", "1"), "event.recorded_peak has '1'"),
    "a huge number": (put("tables/job.jsonl", "claims", 2**40), "job.claims has"),
    "no time": (put("tables/event.jsonl", "start", "yesterday"), "event.start has 'yesterday', which is not a time"),
    "no base64": (put("tables/waveform.jsonl", "samples", "???"), "waveform.samples has a value that is not base64"),
    "another column": (put("tables/event.jsonl", "colour", "red"), "with missing or additional columns: colour"),
    "a row twice": (put("tables/mode_result.jsonl", "id", 1), "it contradicts itself"),
    "a NUL": (put("tables/alert_comment.jsonl", "text", "a\0b"), "NUL character"),
    "facts that are none": (put("tables/message.jsonl", "facts", [1]), "a row of message is malformed"),
}


def without_series(members: dict[str, Any]) -> None:
    """Shorten what is long, so that many imports take a moment."""
    for name in ("waveform", "direction_result", "layer_result", "model_comparison"):
        for row in members[f"tables/{name}.jsonl"]:
            row |= {key: "aQ==" for key, value in row.items() if isinstance(value, str) and len(value) > 200}


def first_file(members: dict[str, Any]) -> str:
    return next(name for name in members if name.startswith("files/"))


@pytest.mark.sqlite
def test_a_file_that_is_hostile_or_damaged_is_refused_as_a_whole(
    whole: bytes, tmp_path: Path, sessions: sessionmaker[Session]
) -> None:
    small = edited(whole, without_series)
    for name, (edit, reason) in REFUSED.items():
        with pytest.raises(ArchiveError, match=reason):
            imported(sessions, edited(small, edit), tmp_path)
        assert number_of_rows(sessions) == 0, name
    middle = len(whole) // 2
    for data, reason in (
        (whole[:middle], "not an export of a building, or its end is missing"),
        (b"not a zip file", "not an export of a building"),
        (b"", "not an export of a building"),
        (whole[:middle] + bytes(64) + whole[middle + 64 :], "damaged|other bytes|changed"),
    ):
        with pytest.raises(ArchiveError, match=reason):
            imported(sessions, data, tmp_path)
        assert number_of_rows(sessions) == 0, reason
    imported(sessions, small, tmp_path)


def test_every_table_is_exported_or_left_out_with_a_reason() -> None:
    of_export = {one.name for one in contents.tables()}
    assert of_export | {*contents.LEFT_OUT, contents.FILES} == set(Base.metadata.tables)
    assert not of_export & {*contents.LEFT_OUT}
    for table in contents.tables():
        assert contents.belongs(table, 1) is not None, table.name


@pytest.mark.sqlite
def test_the_commands_write_and_read_a_file(
    in_use: Path, tmp_path: Path, database_url: str, sessions: sessionmaker[Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def ran(url: str, *arguments: str) -> Result:
        monkeypatch.setenv("MENSHIN_DATABASE_URL", url)
        return CliRunner().invoke(app, ["building", *arguments])

    at_home = f"sqlite:///{in_use}"
    done = ran(at_home, "export", "PAPER", "out/paper.zip")
    assert done.exit_code == 0, done.output
    assert "rows and 3 original files" in done.stdout
    assert "without passwords and secrets" in done.stderr
    [file] = (tmp_path / "out").iterdir()
    assert (file.name, file.stat().st_mode & 0o777) == ("paper.zip", 0o600)
    again = ran(at_home, "export", "PAPER", "out/paper.zip")
    assert (again.exit_code, "exists already" in again.stderr) == (1, True)
    unknown = ran(at_home, "export", "TOWER", "out/tower.zip")
    assert (unknown.exit_code, "there are: PAPER" in unknown.stderr) == (1, True)
    assert [one.name for one in (tmp_path / "out").iterdir()] == ["paper.zip"], "no beginning of a file stays"

    done = ran(database_url, "import", "out/paper.zip")
    assert done.exit_code == 0, done.output
    assert done.stdout.startswith("PAPER is monitored: ")
    with sessions() as session:
        assert session.query(AuditEntry).one().action.endswith("building import")
    again = ran(database_url, "import", "out/paper.zip")
    assert (again.exit_code, "already exists here" in again.stderr) == (1, True)
