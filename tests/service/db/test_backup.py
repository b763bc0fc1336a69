"""A database is copied while it is in use, and put back: nothing but whole copies of Menshin's own is taken."""

import sqlite3
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import databases
import pytest
from typer.testing import CliRunner

from service.cli import app
from service.db.backup import AT_ONCE, BackupError, backup, restore
from service.db.sessions import engine

pytestmark = pytest.mark.sqlite

NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
BEFORE = "menshin.sqlite.before-20260301T120000Z"
PAGE = 4096


def silent(doing: str, done: int, of: int) -> None:
    assert 0 <= done <= of, doing


def add_key(connection: sqlite3.Connection, name: str) -> None:
    """Add a row in a transaction of its own."""
    connection.execute(
        "INSERT INTO api_key (name, role, hash, created_at) VALUES (?, 'viewer', ?, '2026-01-01')", (name, name)
    )
    connection.commit()


def keys(file: Path) -> list[str]:
    """Names of the keys in a database."""
    with closing(sqlite3.connect(file)) as connection:
        return [name for (name,) in connection.execute("SELECT name FROM api_key ORDER BY id")]


@pytest.fixture
def url(tmp_path: Path) -> str:
    """A database with a key and enough pages to be copied in several steps, in write-ahead mode."""
    made = databases.sqlite(tmp_path)
    with closing(sqlite3.connect(tmp_path / "menshin.sqlite")) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        data = bytes(3 * AT_ONCE * PAGE)
        connection.execute("INSERT INTO content (sha256, size, data) VALUES ('0', ?, ?)", (len(data), data))
        add_key(connection, "first")
    return made


def test_a_backup_has_one_moment_while_others_go_on_writing(url: str, tmp_path: Path) -> None:
    steps: list[int] = []
    with closing(sqlite3.connect(tmp_path / "menshin.sqlite")) as writer:

        def report_step(doing: str, done: int, of: int) -> None:
            steps.append(done)
            assert len(steps) < 100, "each commit begins the copy anew"
            add_key(writer, f"during step {len(steps)}")

        size = backup(url, tmp_path / "copies" / "backup.sqlite", report_step)
    assert steps == sorted(set(steps)), "no commit of another process began the copy anew"
    assert len(steps) >= 3
    assert keys(tmp_path / "copies" / "backup.sqlite") == ["first"]
    assert len(keys(tmp_path / "menshin.sqlite")) == 1 + len(steps)
    [file] = (tmp_path / "copies").iterdir()
    assert (file.stat().st_size, file.stat().st_mode & 0o777) == (size, 0o600)


def test_a_restored_database_is_the_backup_and_the_one_before_stays(url: str, tmp_path: Path) -> None:
    backup(url, tmp_path / "backup.sqlite", silent)
    with closing(sqlite3.connect(tmp_path / "menshin.sqlite")) as writer:
        add_key(writer, "later")
    (tmp_path / "menshin.sqlite").chmod(0o660)
    assert restore(url, tmp_path / "backup.sqlite", NOW) == tmp_path / BEFORE
    assert keys(tmp_path / "menshin.sqlite") == ["first"]
    assert keys(tmp_path / BEFORE) == ["first", "later"]
    assert (tmp_path / "menshin.sqlite").stat().st_mode & 0o777 == 0o660, "the group keeps its rights"
    (tmp_path / "menshin.sqlite").unlink()
    assert restore(url, tmp_path / "backup.sqlite", NOW) is None
    assert keys(tmp_path / "menshin.sqlite") == ["first"]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["backup.sqlite", "menshin.sqlite", BEFORE]


def test_a_database_in_use_is_not_replaced(url: str, tmp_path: Path) -> None:
    backup(url, tmp_path / "backup.sqlite", silent)
    service = engine(url)
    with service.connect() as connection:  # an idle process keeps its connection
        connection.exec_driver_sql("SELECT 1")
    with pytest.raises(BackupError, match=r"is in use .* stop all processes"):
        restore(url, tmp_path / "backup.sqlite", NOW)
    service.dispose()
    assert not (tmp_path / BEFORE).exists()
    restore(url, tmp_path / "backup.sqlite", NOW)


def test_a_damaged_database_is_replaced_too(url: str, tmp_path: Path) -> None:
    backup(url, tmp_path / "backup.sqlite", silent)
    (tmp_path / "menshin.sqlite").write_bytes(b"not a database" * 1000)
    restore(url, tmp_path / "backup.sqlite", NOW)
    assert keys(tmp_path / "menshin.sqlite") == ["first"]
    assert (tmp_path / BEFORE).read_bytes().startswith(b"not a database")


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: 100 * PAGE])


def overwritten(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[5 * PAGE : 60 * PAGE] = b"\xff" * (55 * PAGE)
    file.write_bytes(data)


def of_another_program(file: Path) -> None:
    file.unlink()
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("CREATE TABLE films (id INTEGER)")


def of_the_future(file: Path) -> None:
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999_future'")
        connection.commit()


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (cut, "is damaged|cannot be read as a database"),
        (overwritten, "is damaged|cannot be read as a database"),
        (of_another_program, "is not a database of Menshin"),
        (of_the_future, "another version of Menshin .revision 9999_future"),
        (lambda file: file.write_text("a letter" * 100), "cannot be read as a database: file is not a database"),
    ],
    ids=["cut", "overwritten", "another", "future", "letter"],
)
def test_what_is_no_whole_database_of_menshin_is_not_restored(
    url: str, tmp_path: Path, spoil: Callable[[Path], None], reason: str
) -> None:
    backup(url, tmp_path / "backup.sqlite", silent)
    spoil(tmp_path / "backup.sqlite")
    with pytest.raises(BackupError, match=reason):
        restore(url, tmp_path / "backup.sqlite", NOW)
    assert keys(tmp_path / "menshin.sqlite") == ["first"]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["backup.sqlite", "menshin.sqlite"]


def test_the_commands_say_what_they_do(url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)

    def ran(address: str, *arguments: str) -> tuple[int, str]:
        monkeypatch.setenv("MENSHIN_DATABASE_URL", address)
        done = CliRunner().invoke(app, arguments)
        return done.exit_code, done.output

    code, said = ran(url, "backup", "backup.sqlite")
    assert (code, said.startswith("backup.sqlite: "), said.endswith(" MB, checked\n")) == (0, True, True)
    assert ran(url, "backup", "backup.sqlite") == (
        1,
        "backup.sqlite exists already; name another file, or move it away\n",
    )
    code, said = ran(url, "restore", "backup.sqlite")
    assert (code, "restored from backup.sqlite; the database before it is" in said) == (0, True)
    code, said = ran(f"sqlite:///{tmp_path / 'none.sqlite'}", "backup", "other.sqlite")
    assert (code, "does not exist; correct database_url" in said) == (1, True)
    server = "postgresql://menshin:s3cret@127.0.0.1/shm"
    document = (Path(__file__).parents[3] / "docs" / "operate" / "running.md").read_text("utf-8")
    for command in ("backup", "restore"):
        code, said = ran(server, command, "backup.sqlite")
        assert (code, "s3cret" in said) == (1, False)
        for documented in ("pg_dump --format=custom --file=menshin.dump ", "pg_restore --dbname="):
            assert documented in said
            assert documented in document
        assert "--clean --if-exists menshin.dump" in said
