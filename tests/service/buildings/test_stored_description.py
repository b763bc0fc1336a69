"""A building's description is parsed when it is stored, and not again when it is read."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from building_files import FOLDER, SMALL
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import description, store as building_store
from service.buildings.tables import Revision

NOW = datetime(2024, 1, 1, tzinfo=UTC)
SERVER = """kind = "fdsnws"
location = "http://127.0.0.1:1"
since = 2020-01-01T00:00:00+09:00
"""
RECEIVER = """
[[receiver]]
name = "pager"
kind = "webhook"
address = "https://127.0.0.1/hook"
secret = "env:PAGER"
severities = ["all_clear", "alarm"]
"""
WITH_MORE = SMALL.replace('kind = "folder"\nlocation = "records"\n', SERVER) + RECEIVER


@pytest.mark.parametrize("text", [SMALL, WITH_MORE], ids=["small", "with a server and a recipient"])
def test_the_stored_description_equals_the_file(text: str) -> None:
    assert description.restored(description.stored(text), FOLDER) == description.read(text, FOLDER)


def added(sessions: sessionmaker[Session], **changed: str | None) -> description.BuildingFile:
    """The description as read after columns of its revision were changed."""
    with sessions.begin() as session:
        made = building_store.add(session, SMALL, FOLDER, NOW)
        session.flush()
        for name, value in changed.items():
            setattr(session.query(Revision).one(), name, value)
        number = made.id
    with sessions() as session:
        return building_store.described(session, session.get_one(type(made), number))


def test_the_file_is_not_parsed_again(sessions: sessionmaker[Session]) -> None:
    assert added(sessions, toml="this is not TOML") == description.read(SMALL, FOLDER)


@pytest.mark.parametrize("parsed", [None, '{"code": "TOWER", "a key of another version": 1}'])
def test_a_revision_without_usable_tables_is_read_from_its_file(
    sessions: sessionmaker[Session], parsed: str | None
) -> None:
    assert added(sessions, parsed=parsed) == description.read(SMALL, Path(FOLDER))
