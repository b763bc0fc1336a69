"""Write docs/reference/cli.md from the commands themselves: `python docs/tools/write_cli.py`."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from service.cli import app

TARGET = Path(__file__).parents[1] / "reference" / "cli.md"
OPENING = """\
# The command line

`python docs/tools/write_cli.py` writes this page from the commands themselves. `menshin --version` prints the version;
`menshin COMMAND --help` prints the section of that command.
"""
TYPERS_OWN = ("install_completion", "show_completion")
"""Options that typer adds to every program."""


def document() -> str:
    """The whole reference."""
    return "\n".join([OPENING, *_commands("menshin", typer.main.get_command(app))])


def _commands(path: str, command: Any) -> Iterator[str]:  # noqa: ANN401  click's or typer's own, by version
    """A section for every command, groups before their members."""
    if members := getattr(command, "commands", None):
        if path != "menshin":
            yield f"## `{path}`\n\n{_text(command.help)}\n"
        for name, member in members.items():
            yield from _commands(f"{path} {name}", member)
        return
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and p.name not in TYPERS_OWN]
    names = " ".join(_argument(argument) for argument in arguments)
    yield f"## `{f'{path} {names}'.strip()}`\n\n{_text(command.help)}\n"
    if arguments or options:
        yield "| | meaning | default |\n|---|---|---|"
        yield from (f"| `{_argument(a)}` | {_text(a.help)} | |" for a in arguments)
        yield from (
            f"| `{', '.join([*o.opts, *o.secondary_opts])}` | {_text(o.help)} | {_default(o)} |" for o in options
        )
        yield ""


def _argument(parameter: Any) -> str:  # noqa: ANN401  click's or typer's own, by version
    return parameter.metavar or parameter.name.upper() + ("..." if parameter.nargs == -1 else "")


def _default(parameter: Any) -> str:  # noqa: ANN401  click's or typer's own, by version
    if parameter.required:
        return "required"
    return "" if parameter.default is None or parameter.is_flag else f"`{parameter.default}`"


def _text(help_text: str | None) -> str:
    return " ".join((help_text or "").split())


if __name__ == "__main__":
    TARGET.write_text(document(), encoding="utf-8")
