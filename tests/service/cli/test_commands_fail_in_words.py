"""Every command ends in words, whatever is wrong with its database, its settings or its files."""

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import small_disks
import typer
from building_files import SMALL
from click.testing import Result
from command_examples import WAITING, WITH_DATABASE, WITHOUT
from monitoring_server import building_file, miniseed, stream
from processes import run
from sqlalchemy import create_engine, make_url, text
from typer.testing import CliRunner

from service.cli import app
from service.db import migrate
from service.db.sessions import engine

SECRET = "s3cret"


def commands(path: str = "", command: object = None) -> Iterator[str]:
    command = command or typer.main.get_command(app)
    members = getattr(command, "commands", None)
    if members is None:
        yield path
    for name, member in (members or {}).items():
        yield from commands(f"{path} {name}".strip(), member)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with a building file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)
    monkeypatch.setenv("MENSHIN_SECRET_KEY", "A" * 43 + "=")
    (tmp_path / "building.toml").write_text(SMALL, "utf-8")
    return tmp_path


def ended(command: str, monkeypatch: pytest.MonkeyPatch, url: str) -> Result:
    monkeypatch.setenv("MENSHIN_DATABASE_URL", url)
    return CliRunner().invoke(app, [*command.split(), *WITH_DATABASE.get(command, [])])


def check(done: Result, *expected: str) -> None:
    """One or two lines, no traceback, no secret, not a success."""
    assert isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code in (1, 2)
    lines = [line for line in done.stderr.splitlines() if " INFO " not in line]
    assert 1 <= len(lines) <= 2, done.stderr
    assert "Traceback" not in done.output
    assert SECRET not in done.output
    for one in expected:
        assert one in done.stderr, done.stderr


def test_every_command_is_tried_here() -> None:
    tried = {name.removesuffix(" --once") for name in WITH_DATABASE} | WITHOUT
    assert set(commands()) <= tried, "add the new command to WITH_DATABASE or WITHOUT"


def newer(path: Path) -> None:
    migrate.upgrade(f"sqlite:///{path}")
    made = engine(f"sqlite:///{path}")
    with made.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999_future'"))
    made.dispose()


def foreign(path: Path) -> None:
    made = create_engine(f"sqlite:///{path}")
    with made.begin() as connection:
        connection.execute(text("CREATE TABLE films (id INTEGER)"))
    made.dispose()


@pytest.mark.parametrize(
    ("make", "address", "expected"),
    [
        (Path.mkdir, "sqlite:///{}", ("cannot be opened", "check that its path names a file")),
        (newer, "sqlite:///{}", ("belongs to another version of Menshin", "9999_future", "run that version")),
        (foreign, "sqlite:///{}", ("has tables of another program (films)", "name another database")),
        (
            lambda path: path.write_text("not a database, but a letter"),
            "sqlite:///{}",
            ("is not an SQLite database", "name another file"),
        ),
        (
            lambda path: migrate.upgrade(f"sqlite:///{path}"),
            "sqlite:///file:{}?mode=ro&uri=true",
            ("is read-only", "give this account the right to write"),
        ),
        (
            lambda path: path.write_text("a file where a folder is named"),
            "sqlite:///{}/menshin.sqlite",
            ("database",),
        ),
        (lambda path: None, f"postgre://alice:{SECRET}@127.0.0.1/{{}}", ("database_url: 'postgre' is not a kind",)),
        (lambda path: None, f"alice:{SECRET}", ("database_url: this is not the address of a database",)),
        (
            lambda path: None,
            f"postgresql://alice:{SECRET}@127.0.0.1:port/x",
            ("database_url: this is not the address",),
        ),
        (lambda path: None, "sqlite://menshin.sqlite", ("database_url: an SQLite file is named after three slashes",)),
    ],
    ids=[
        *("directory", "newer", "foreign", "junk", "read-only", "file-as-folder"),
        *("misspelt", "no-address", "port", "two-slashes"),
    ],
)
def test_a_file_that_cannot_be_the_database(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[Path], object],
    address: str,
    expected: tuple[str, ...],
) -> None:
    path = folder / "database"
    make(path)
    for command in WITH_DATABASE:
        check(ended(command, monkeypatch, address.format(path)), *expected)


def test_a_server_that_is_away(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = door.getsockname()[1]
    for command in WITH_DATABASE.keys() - WAITING:
        done = ended(command, monkeypatch, f"postgresql://alice:{SECRET}@127.0.0.1:{port}/menshin")
        check(done, f"the database menshin at 127.0.0.1:{port} cannot be reached: no server listens there")


def test_a_server_without_the_database_or_the_user(monkeypatch: pytest.MonkeyPatch, postgres: str) -> None:
    nowhere = make_url(postgres).set(database="nowhere").render_as_string(hide_password=False)
    nobody = make_url(postgres).set(username="nobody_here").render_as_string(hide_password=False)
    for command in WITH_DATABASE:
        for url in (nowhere, nobody):
            check(ended(command, monkeypatch, url), "does not exist", "correct database_url")


def test_a_database_of_a_server_that_may_only_be_read_or_is_newer(
    monkeypatch: pytest.MonkeyPatch, postgres_database_url: str
) -> None:
    url = postgres_database_url
    migrate.upgrade(url)
    made = engine(url)
    with made.begin() as connection:
        connection.execute(text(f"ALTER DATABASE {made.url.database} SET default_transaction_read_only = on"))
    for command in ("building add", "key create"):
        check(ended(command, monkeypatch, url), "is read-only")
    with made.begin() as connection:
        connection.execute(text("SET TRANSACTION READ WRITE"))
        connection.execute(text("UPDATE alembic_version SET version_num = '9999_future'"))
    made.dispose()
    for command in WITH_DATABASE:
        check(ended(command, monkeypatch, url), "belongs to another version of Menshin")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 256 KiB."""
    with small_disks.small_disk(tmp_path / "disk", "256k") as folder:
        yield folder


@pytest.mark.parametrize("command", ["building list", "poll"])
def test_a_read_only_file_system(small_disk: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    url = f"sqlite:///{small_disk / 'menshin.sqlite'}"
    check(ended(command, monkeypatch, url), "is on a read-only file system", "make it writable")


def test_a_full_disk(small_disk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check(ended("building list", monkeypatch, f"sqlite:///{small_disk / 'menshin.sqlite'}"), "disk", "free some space")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"port = ", ("menshin.toml is not TOML",)),
        (b"\xff\xfe", ("menshin.toml is not text in UTF-8",)),
        (b"prot = 1", ("prot: no such key; did you mean 'port'?",)),
        (b"poll_interval = 'many'", ("polling.interval: ",)),
        (None, ("menshin.toml",)),
    ],
    ids=["no-toml", "no-text", "unknown-key", "wrong-value", "directory"],
)
def test_settings_that_cannot_be_read(
    folder: Path, monkeypatch: pytest.MonkeyPatch, content: bytes | None, expected: tuple[str, ...]
) -> None:
    file = folder / "menshin.toml"
    if content is None:
        file.mkdir()
        monkeypatch.setenv("MENSHIN_SETTINGS", str(file))
    else:
        file.write_bytes(content)
    for command in WITH_DATABASE:
        done = ended(command, monkeypatch, f"sqlite:///{folder / 'menshin.sqlite'}")
        check(done, *expected)
        assert done.exit_code == 2


def test_an_unknown_variable_is_warned_of_with_the_nearest_name(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MENSHIN_POL_INTERVAL", SECRET)
    monkeypatch.setenv("MENSHIN_ZZZ", "5")
    done = ended("building list", monkeypatch, f"sqlite:///{folder / 'menshin.sqlite'}")
    assert done.exit_code == 0
    assert done.stderr.splitlines() == [
        "warning: the variable MENSHIN_POL_INTERVAL is not a setting and is ignored; did you mean "
        "MENSHIN_POLLING__INTERVAL?",
        "warning: the variable MENSHIN_ZZZ is not a setting and is ignored; `menshin settings` lists all settings",
    ]
    monkeypatch.delenv("MENSHIN_POL_INTERVAL")
    monkeypatch.delenv("MENSHIN_ZZZ")
    assert ended("building list", monkeypatch, f"sqlite:///{folder / 'menshin.sqlite'}").stderr == ""


@pytest.mark.parametrize("command", ["building add", "building update TOWER"])
def test_a_building_file_that_is_no_text(folder: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    (folder / "building.toml").write_bytes(b"\xff\xfe\x00")
    monkeypatch.setenv("MENSHIN_DATABASE_URL", f"sqlite:///{folder / 'menshin.sqlite'}")
    done = CliRunner().invoke(app, [*command.split(), "building.toml"])
    check(done, "building.toml is not text in UTF-8")


def test_results_that_cannot_be_written(folder: Path) -> None:
    (folder / "building.toml").write_text(building_file())
    (folder / "a.mseed").write_bytes(miniseed(stream(seconds=60)))
    (folder / "results").write_text("a file")
    done = CliRunner().invoke(app, ["analyse", "a.mseed", "--building", "building.toml", "--json", "results/a.json"])
    check(done, "results")


def test_a_bug_is_shown_where_it_can_be_mended(folder: Path) -> None:
    """The output of a service goes into a log: the traceback belongs there, with a line that says what it is."""
    broken = "from service import cli; import service.settings as s; s.Settings = None; cli.app(['settings'])"
    done = subprocess.run([sys.executable, "-c", broken], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 70
    assert "Traceback" in done.stderr
    assert (
        done.stderr.splitlines()[-1] == "menshin stopped because of a bug (AttributeError); the lines above show where"
    )


def test_a_taken_port(folder: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = str(door.getsockname()[1])
        for command in ("up", "api"):
            done = run(folder, f"sqlite:///{folder / 'menshin.sqlite'}", command, "--port", port)
            assert (done.returncode, done.stdout) == (1, "")
            assert done.stderr == (
                f"port {port} of 127.0.0.1 is in use by another process; end that process, or choose another by "
                f"MENSHIN_PORT or --port\n"
            )


def test_an_address_that_is_not_of_this_machine(folder: Path) -> None:
    done = run(folder, f"sqlite:///{folder / 'menshin.sqlite'}", "api", MENSHIN_HOST="192.0.2.1")
    assert done.returncode == 1
    assert done.stderr.startswith("192.0.2.1 is not an address of this machine; correct MENSHIN_HOST")
