"""Exports of earlier versions are imported with everything in them, or refused as a whole.

`first_export.zip` was written by the code of the commit that added exports, with the revision 0035: the building of
tests/service/db/test_first_version.py with two alerts, a comment, two delivered messages and a live stream.
"""

import json
from pathlib import Path
from typing import Any

import pytest
from api_client import client
from databases import RENAMED
from exports import Edit, add, edited, entries, number_of_rows, put
from sqlalchemy.orm import Session, sessionmaker
from typer.testing import CliRunner

from service.cli import app
from service.settings.groups import Storage
from service.transfer import earlier
from service.transfer.archive import MANIFEST, ArchiveError
from service.transfer.importing import import_building

FIRST = Path(__file__).with_name("first_export.zip")
FILLED_AGAIN = {"tables/recorded_channel.jsonl"}
"""Tables that a migration has filled from others since."""


def rows(data: bytes) -> dict[str, list[dict[str, Any]]]:
    """The rows of an export by table."""
    tables = {name: one for name, one in entries(data).items() if name.startswith("tables/")}
    return {name: [json.loads(line) for line in one.splitlines()] for name, one in tables.items()}


def test_an_export_of_the_first_version_is_imported_with_everything_in_it(
    database_url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    again = tmp_path / "again.zip"
    for arguments in (("import", str(FIRST)), ("export", "PAPER", str(again), "--with-secrets")):
        done = CliRunner().invoke(app, ["building", *arguments])
        assert done.exit_code == 0, done.output
    was, now = FIRST.read_bytes(), again.read_bytes()
    for table, had in rows(was).items():
        found = rows(now)[table]
        assert len(found) == len(had), table
        if table not in FILLED_AGAIN:
            kept = [
                {name: after[RENAMED.get(name, name)] for name in before}
                for before, after in zip(had, found, strict=True)
            ]
            assert kept == had
    files = {name: one for name, one in entries(was).items() if name.startswith("files/")}
    assert files.items() <= entries(now).items()
    assert files
    with client(database_url) as api:
        [event] = api.get("/api/v1/buildings/PAPER/events").json()["items"]
        assert event["state"] == "analysed"
        assert len(api.get("/api/v1/alerts?building=PAPER").json()["items"]) == 2
        pages = ("/", "/buildings/PAPER", f"/events/{event['id']}", "/alerts/1", f"/api/v1/events/{event['id']}")
        assert {path: api.get(path).status_code for path in pages} == dict.fromkeys(pages, 200)
        channels = "/fdsnws/station/1/query?net=XX&level=channel&format=text"
        assert len(api.get(channels).text.splitlines()) == 1 + len(rows(was)["tables/recorded_channel.jsonl"])


REFUSED: dict[str, tuple[Edit, str]] = {
    "a later version": (put(MANIFEST, "revision", "0099_future"), "Upgrade this installation to the other's version"),
    "a missing table": (
        lambda members: (members.pop("tables/alert.jsonl"), members[MANIFEST]["tables"].pop("alert")),
        "table alert is missing",
    ),
    "a table of keys": (add("tables/api_key.jsonl", b""), "table api_key is missing, or is not a table of an export"),
    "a later column": (put("tables/building.jsonl", "latitude", 1.0), "with missing or additional columns: latitude"),
    "a missing value": (put("tables/event.jsonl", "state", None), "event.state is missing"),
    "no time": (put("tables/event.jsonl", "start", "yesterday"), "event.start has 'yesterday', which is not a time"),
    "a row twice": (put("tables/mode_result.jsonl", "id", 1), "it contradicts itself"),
    "another building's row": (put("tables/alert.jsonl", "building_id", 2), "rows that do not belong to building"),
    "a lost parent": (put("tables/mode_result.jsonl", "result_id", 9), "rows that do not belong to building 'PAPER'"),
    "another building": (put(MANIFEST, "building", "TOWER"), "its building is not 'TOWER', as its manifest says"),
    "other bytes": (lambda members: members.update({first_file(members): b"!"}), "does not match its name"),
}


def first_file(members: dict[str, Any]) -> str:
    return next(name for name in members if name.startswith("files/"))


@pytest.mark.sqlite
@pytest.mark.parametrize("name", REFUSED)
def test_an_export_of_an_earlier_version_that_is_hostile_is_refused_as_a_whole(
    tmp_path: Path, sessions: sessionmaker[Session], name: str
) -> None:
    edit, reason = REFUSED[name]
    file = tmp_path / "building.zip"
    file.write_bytes(edited(FIRST.read_bytes(), edit))
    with pytest.raises(ArchiveError, match=reason), earlier.opened(file) as found:
        import_building(sessions, found, lambda *_: None, Storage())
    assert number_of_rows(sessions) == 0
