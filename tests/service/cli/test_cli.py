import importlib.metadata
import importlib.util
import os
import subprocess
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest
import typer
import write_cli
from paper_records import building_file
from rich.text import Text
from typer.testing import CliRunner

from service.cli import app

HEAVY = ("obspy", "numba", "scipy", "altair", "sqlalchemy", "fastapi", "numpy")
UNUSED = {
    "effects": ("obspy", "numba", "scipy", "altair", "fastapi", "sqlalchemy", "numpy"),
    "model new --building building.toml --output model.toml": ("obspy", "numba", "scipy", "altair", "fastapi"),
    "status": ("obspy", "numba", "scipy", "altair", "fastapi", "babel", "numpy", "cryptography"),
    "building list": ("obspy", "numba", "scipy", "altair", "fastapi", "numpy", "cryptography"),
    "notify --once": ("obspy", "numba", "scipy", "altair", "fastapi", "numpy", "httpx", "jinja2", "cryptography"),
    "poll --once": ("obspy", "numba", "scipy", "altair", "fastapi", "cryptography"),
    "work --once": ("obspy", "scipy.signal", "scipy.stats", "altair", "fastapi"),
}
"""Modules that take long to import, by commands that have no use for them."""


def commands(path: str = "menshin", command: object = None) -> Iterator[tuple[str, object]]:
    command = command or typer.main.get_command(app)
    yield path, command
    for name, member in getattr(command, "commands", {}).items():
        yield from commands(f"{path} {name}", member)


@pytest.mark.parametrize(("path", "command"), tuple(commands()))
def test_every_command_argument_and_option_has_a_help_text(path: str, command: object) -> None:
    for where, one in ((path, command), *((f"{path} {one.name}", one) for one in getattr(command, "params", ()))):
        text = getattr(one, "help", None)
        assert text, where
        assert Text.from_markup(text).plain == text, f"{where}: a part in square brackets would not be printed"


def test_the_reference_is_what_the_commands_say() -> None:
    assert write_cli.TARGET.read_text("utf-8") == write_cli.document(), "python docs/tools/write_cli.py would mend it"


def test_help_needs_nothing_heavy() -> None:
    """Slow imports happen only in commands that need them."""
    script = f"import sys, service.cli; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(("command", "unused"), tuple(UNUSED.items()))
def test_a_command_imports_what_it_needs(command: str, unused: Collection[str], tmp_path: Path) -> None:
    (tmp_path / "building.toml").write_text(building_file(), "utf-8")
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", "from service.cli import app; app()", *command.split()],
        capture_output=True,
        text=True,
        env={**os.environ, "MENSHIN_DATABASE_URL": "sqlite:///a.db"},
        cwd=tmp_path,
    )
    loaded = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines() if line.startswith("import time:")}
    assert "service.settings" in loaded, done.stderr[-2000:]
    assert not loaded & set(unused)


def test_a_command_on_a_database_of_this_version_needs_no_migrations(tmp_path: Path) -> None:
    script = (
        "import sys; from service.db.migrate import upgrade; upgrade('sqlite:///a.db'); print('alembic' in sys.modules)"
    )
    again = [
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=tmp_path)
        for _ in range(2)
    ]
    assert [done.stdout.strip() for done in again] == ["True", "False"]


@pytest.mark.parametrize(("given", "threads"), [({}, 1), ({"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"}, 2)])
def test_linear_algebra_has_one_thread_unless_a_person_gives_it_more(given: dict[str, str], threads: int) -> None:
    script = (
        "import os; from service.cli import app; app(['effects'], standalone_mode=False); import numpy.linalg; "
        "print('threads', len(os.listdir('/proc/self/task')))"
    )
    inherited = {name: value for name, value in os.environ.items() if not name.endswith("NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=inherited | given)
    assert done.stdout.splitlines()[-1] == f"threads {threads}", done.stderr[-2000:]


def test_without_a_command_the_help_is_shown() -> None:
    shown = CliRunner().invoke(app, [])
    assert "Structural health monitoring" in shown.output


def test_the_version_is_that_of_the_installed_program() -> None:
    done = CliRunner().invoke(app, ["--version"])
    assert (done.exit_code, done.stdout) == (0, f"menshin {importlib.metadata.version('menshin')}\n")
