"""Secrets in the database are encrypted with a key from the environment, and its file is the owner's alone."""

import os
import sqlite3
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event

import pytest
from api_client import client
from building_files import SMALL
from sqlalchemy import text
from sqlalchemy.orm import Session, sessionmaker
from typer.testing import CliRunner

from service.buildings import recipients, store as building_store
from service.cli import app
from service.db import migrate
from service.db.encryption import VARIABLE, SecretKeyError, new_key
from service.db.sessions import engine
from service.roles import running
from service.settings import Settings

NOW = datetime(2024, 1, 1, tzinfo=UTC)
SECRET = "whsec_" + "c2VjcmV0" * 6
HOOK = f"""
[[receiver]]
name = "program"
kind = "webhook"
address = "https://127.0.0.1/hook/token-of-ours"
secret = "{SECRET}"
"""
PLAIN = (SECRET, "token-of-ours")


def add(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building_store.add(session, SMALL + HOOK, Path("/"), NOW)


def stored(sessions: sessionmaker[Session]) -> list[str]:
    """Raw values in the database."""
    with sessions() as session:
        rows = (*session.execute(text("SELECT address, secret FROM receiver")).one(), *_revision(session))
        return [str(value) for value in rows]


def _revision(session: Session) -> tuple[object, ...]:
    return tuple(session.execute(text("SELECT toml FROM revision")).one())


def read(sessions: sessionmaker[Session]) -> tuple[str, str | None]:
    with sessions() as session:
        (row,) = recipients.of_building(session, 1)
        building_store.described(session, row.building)
        return row.address, row.secret


@pytest.fixture(autouse=True)
def _without_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


def test_with_a_key_no_secret_is_stored_in_plain_text(
    sessions: sessionmaker[Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, new_key())
    add(sessions)
    assert all(value.startswith("fernet:") for value in stored(sessions))
    assert not any(plain in value for plain in PLAIN for value in stored(sessions))
    assert read(sessions) == ("https://127.0.0.1/hook/token-of-ours", SECRET)


def test_old_rows_stay_readable_are_encrypted_by_a_command_and_keys_are_replaced(
    sessions: sessionmaker[Session], database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    add(sessions)
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    refused = CliRunner().invoke(app, ["secret", "encrypt"])
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    old, new = (CliRunner().invoke(app, ["secret", "new-key"]).stdout.strip() for _ in range(2))
    assert old != new
    before = read(sessions)
    for keys in (old, f"{new},{old}"):
        monkeypatch.setenv(VARIABLE, keys)
        assert read(sessions) == before
        done = CliRunner().invoke(app, ["secret", "encrypt"])
        assert done.exit_code == 0, done.output
        assert "3 secrets are encrypted" in done.stdout
        assert not any(plain in value for plain in PLAIN for value in stored(sessions))
    monkeypatch.setenv(VARIABLE, new)
    assert read(sessions) == before


def test_a_missing_or_wrong_key_is_stated_in_words(
    sessions: sessionmaker[Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, new_key())
    add(sessions)
    for value, words in (("", "Set MENSHIN_SECRET_KEY"), (new_key(), "No key in"), ("hunter2", "contains no key")):
        monkeypatch.setenv(VARIABLE, value)
        with pytest.raises(SecretKeyError, match=words) as raised:
            read(sessions)
        assert "hunter2" not in str(raised.value)


def test_a_page_that_needs_a_secret_reports_the_missing_key(
    sessions: sessionmaker[Session], database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, new_key())
    add(sessions)
    with client(database_url) as api:
        assert api.get("/api/v1/buildings/TOWER/receivers").status_code == 200
        monkeypatch.delenv(VARIABLE)
        answer = api.get("/api/v1/buildings/TOWER/receivers")
    assert (answer.status_code, VARIABLE in answer.json()["detail"]) == (503, True)


def test_starting_with_plain_secrets_is_logged(
    sessions: sessionmaker[Session],
    database_url: str,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    add(sessions)
    settings = Settings(database_url=database_url)
    with running(settings, Event()):
        assert "addresses and secrets of 1 recipients are stored unencrypted; set MENSHIN_SECRET_KEY" in caplog.text
    caplog.clear()
    monkeypatch.setenv(VARIABLE, new_key())
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    assert CliRunner().invoke(app, ["secret", "encrypt"]).exit_code == 0
    with running(settings, Event()):
        assert "unencrypted" not in caplog.text
    monkeypatch.setenv(VARIABLE, new_key())
    with pytest.raises(SecretKeyError), running(settings, Event()):
        pass


def test_a_new_database_is_its_owners_alone(tmp_path: Path) -> None:
    before = os.umask(0o022)
    try:
        file = tmp_path / "data" / "menshin.sqlite"
        migrate.upgrade(f"sqlite:///{file}")
        made = engine(f"sqlite:///{file}")
        with made.begin() as connection:
            connection.execute(text("INSERT INTO lease (name, holder, until) VALUES ('a', 'b', '2024-01-01')"))
            for written in file.parent.iterdir():
                assert stat.S_IMODE(written.stat().st_mode) == 0o600, written
            assert len(list(file.parent.iterdir())) > 1, "with the journal"
        made.dispose()
        assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
    finally:
        os.umask(before)


def test_the_world_loses_its_rights_on_an_old_database(tmp_path: Path) -> None:
    file = tmp_path / "menshin.sqlite"
    sqlite3.connect(file).close()
    file.touch()
    file.chmod(0o644)
    engine(f"sqlite:///{file}").dispose()
    assert stat.S_IMODE(file.stat().st_mode) == 0o640


def test_a_nul_character_is_refused_in_words_and_no_password_is_logged(
    sessions: sessionmaker[Session], database_url: str, caplog: pytest.LogCaptureFixture
) -> None:
    add(sessions)
    until = (datetime.now(UTC) + timedelta(days=1)).isoformat()
    with client(database_url) as api:
        answers = [
            api.post("/api/v1/buildings/TOWER/silences", json={"pattern": "*", "reason": "load\0test", "until": until}),
            api.post("/buildings/TOWER/silences", data={"pattern": "*", "reason": "load\0test", "hours": "2"}),
            api.get("/api/v1/deliveries", params={"building": "TO\0WER"}),
        ]
    assert [answer.status_code for answer in answers] == [422] * 3, [answer.text[-300:] for answer in answers]
    assert "NUL character" in answers[0].json()["detail"]
    assert "token-of-ours" not in caplog.text


def test_an_error_of_the_database_repeats_no_parameter(sessions: sessionmaker[Session]) -> None:
    add(sessions)
    with sessions() as session, pytest.raises(Exception, match=r"UNIQUE|unique") as raised:
        session.execute(
            text("INSERT INTO building (id, code, name, created_at) VALUES (:i, 'TOWER', :n, '2024-01-01')"),
            {"i": 1, "n": "hunter2"},
        )
    assert "hunter2" not in str(raised.value)
