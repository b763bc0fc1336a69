"""The command `menshin` in this process."""

from click.testing import Result
from typer.testing import CliRunner

from service.cli import app


def menshin(*arguments: object) -> Result:
    """Run it, and return its exit code and output."""
    return CliRunner().invoke(app, [*map(str, arguments)])
