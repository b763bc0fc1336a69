"""Files, folders and ports that this account may not use: every command says so in words."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from building_files import SMALL
from command_examples import WITH_DATABASE
from monitoring_server import building_file
from processes import environment, run
from sqlalchemy import text
from unprivileged import WITHOUT_RIGHTS, can_be_given_away, ended

from service.db import migrate
from service.db.sessions import engine

KEY = "A" * 43 + "="
READ_ONLY = "is read-only; give this account the right to write to it and to its folder"
CLOSED = "cannot be opened; check that its path names a file, and that this account may write to it and to its folder"
SAMPLE = ("up", "work --once", "building list", "key create")
"""Commands that are tried with every fault; all are tried with one."""
LOWEST = Path("/proc/sys/net/ipv4/ip_unprivileged_port_start")

pytestmark = pytest.mark.skipif(
    not can_be_given_away(), reason="root may do everything here, and setpriv is not there to take rights away"
)


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A working directory; what was locked in it is opened again afterwards."""
    (tmp_path / "building.toml").write_text(SMALL, "utf-8")
    yield tmp_path
    for place in (tmp_path, *tmp_path.iterdir()):
        place.chmod(0o755)


def database(place: Path) -> str:
    """Address of a database of ours."""
    place.parent.mkdir(exist_ok=True)
    url = f"sqlite:///{place}"
    migrate.upgrade(url)
    return url


def older(url: str) -> str:
    """As a version before the first table left it: this one has to write before it can read."""
    migrate.downgrade(url, "base")
    return url


def test_every_command_reports_that_it_may_not_use_its_database(folder: Path) -> None:
    cases = {
        database(folder / "locked" / "menshin.sqlite"): CLOSED,
        database(folder / "closed-file.sqlite"): CLOSED,
        f"sqlite:///{folder / 'empty' / 'menshin.sqlite'}": CLOSED,
        database(folder / "read-only" / "menshin.sqlite"): READ_ONLY,
        database(folder / "read-only-file.sqlite"): READ_ONLY,
        older(database(folder / "older" / "menshin.sqlite")): READ_ONLY,
        older(database(folder / "older-file.sqlite")): READ_ONLY,
    }
    (folder / "empty").mkdir()
    (folder / "locked").chmod(0o000)
    (folder / "closed-file.sqlite").chmod(0o000)
    for name in ("read-only-file.sqlite", "older-file.sqlite", "older/menshin.sqlite"):
        (folder / name).chmod(0o444)
    for name in ("empty", "read-only", "older"):
        (folder / name).chmod(0o555)
    last = list(cases)[-1]
    wanted = [
        ([*name.split(), *more], url)
        for url in cases
        for name, more in WITH_DATABASE.items()
        if url == last or name in SAMPLE
    ]
    answers = ended(folder, environment("", MENSHIN_SECRET_KEY=KEY), wanted)
    for (command, url), (code, printed) in zip(wanted, answers, strict=True):
        lines = [line for line in printed.splitlines() if " INFO " not in line]
        assert (code, lines) == (1, [f"the database {url.removeprefix('sqlite:///')} {cases[url]}"]), command
    made = engine(f"sqlite:///{folder / 'older-file.sqlite'}")
    with made.connect() as connection:
        assert connection.scalar(text("SELECT version_num FROM alembic_version")) is None
    made.dispose()


def test_files_and_folders_that_this_account_may_not_read(folder: Path) -> None:
    url = database(folder / "menshin.sqlite")
    (folder / "drop").mkdir()
    (folder / "source.toml").write_text(building_file("folder", str(folder / "drop")), "utf-8")
    (folder / "record.mseed").write_bytes(b"")
    (folder / "drop").chmod(0o000)
    for name in ("building.toml", "record.mseed"):
        (folder / name).chmod(0o000)
    commands = {
        ("building", "add", "building.toml"): (2, "building.toml"),
        ("building", "add", "source.toml"): (0, ""),
        ("import", "record.mseed", "--building", "TOWER"): (2, "record.mseed"),
        ("poll", "--once"): (0, f"{folder / 'drop'} cannot be read: Permission denied; give the service's account"),
    }
    answers = ended(folder, environment(url), [(list(command), url) for command in commands])
    for (command, (status, words)), (code, printed) in zip(commands.items(), answers, strict=True):
        assert code == status, (command, printed)
        assert words in printed, (command, printed)
        assert status == 0 or "not readable" in printed, (command, printed)
        assert "Traceback" not in printed


@pytest.mark.parametrize("command", ["up", "api"])
def test_a_port_that_takes_a_right(folder: Path, command: str) -> None:
    lowest = int(LOWEST.read_text()) if LOWEST.exists() else 1024
    if lowest < 2:
        pytest.skip("every account may listen at every port here")
    port = min(80, lowest - 1)
    url = f"sqlite:///{folder / 'menshin.sqlite'}"
    done = run(folder, url, command, "--port", str(port), before=WITHOUT_RIGHTS)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        f"this account may not listen at port {port} of 127.0.0.1; choose another by MENSHIN_PORT or --port, of "
        f"1024 or more\n"
    )


def test_settings_that_this_account_may_not_read(folder: Path) -> None:
    (folder / "menshin.toml").write_text("port = 8000\n")
    (folder / "menshin.toml").chmod(0o000)
    ((code, printed),) = ended(folder, environment(""), [(["building", "list"], f"sqlite:///{folder / 'm.sqlite'}")])
    assert code == 2, printed
    assert "menshin.toml" in printed
    assert "ermission denied" in printed
