import importlib.metadata
import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from service.cli import app

WRITER = Path(__file__).resolve().parents[3] / "docs" / "tools" / "write_cli.py"
HEAVY = ("obspy", "numba", "scipy", "altair", "sqlalchemy", "fastapi", "numpy")


def commands(path: str = "menshin", command: object = None) -> Iterator[tuple[str, object]]:
    command = command or typer.main.get_command(app)
    yield path, command
    for name, member in getattr(command, "commands", {}).items():
        yield from commands(f"{path} {name}", member)


@pytest.mark.parametrize(("path", "command"), tuple(commands()))
def test_every_command_argument_and_option_has_a_help_text(path: str, command: object) -> None:
    assert getattr(command, "help", None), path
    for parameter in getattr(command, "params", ()):
        assert getattr(parameter, "help", None), f"{path} {parameter.name}"


def test_the_reference_is_what_the_commands_say() -> None:
    spec = importlib.util.spec_from_file_location("write_cli", WRITER)
    assert spec is not None
    assert spec.loader is not None
    writer = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(writer)
    assert writer.TARGET.read_text("utf-8") == writer.document(), "python docs/tools/write_cli.py would mend it"


def test_help_needs_nothing_heavy() -> None:
    """Slow imports happen only in commands that need them."""
    script = f"import sys, service.cli; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_without_a_command_the_help_is_shown() -> None:
    shown = CliRunner().invoke(app, [])
    assert "Structural health monitoring" in shown.output


def test_the_version_is_that_of_the_installed_program() -> None:
    done = CliRunner().invoke(app, ["--version"])
    assert (done.exit_code, done.stdout) == (0, f"menshin {importlib.metadata.version('menshin')}\n")
