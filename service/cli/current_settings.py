"""The settings that a command works under; what is wrong with them ends it with its reason."""

from tomllib import TOMLDecodeError
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

    from service.settings import Settings


def settings_in_force(**given: object) -> "Settings":
    """Arguments that are not None over the environment, the file and the defaults; exit code 2 if they are wrong."""
    from pydantic import ValidationError

    from service.settings import Settings

    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    except ValidationError as error:
        typer.echo("\n".join(map(_told, error.errors())), err=True)
    except TOMLDecodeError as error:
        typer.echo(f"{_file()} is not TOML: {error}", err=True)
    except UnicodeDecodeError as error:
        typer.echo(f"{_file()} is not text in UTF-8 ({error.reason} at byte {error.start})", err=True)
    except OSError as error:
        typer.echo(str(error) if error.strerror is None else f"{error.filename}: {error.strerror}", err=True)
    except ValueError as error:
        typer.echo(str(error), err=True)
    raise typer.Exit(2)


def _file() -> str:
    from service.settings import settings_file

    return str(settings_file())


def _told(wrong: "ErrorDetails") -> str:
    """A line on what is wrong, without a secret: what concerns all settings would repeat every one of them."""
    from service.formats.toml_problems import unknown
    from service.settings import SECRETS, settings_by_name

    name = ".".join(map(str, wrong["loc"]))
    if wrong["type"] == "extra_forbidden":
        return f"{name}: {unknown(name, list(settings_by_name()))}"
    is_shown = name and name not in SECRETS and not isinstance(wrong["input"], dict)
    got = f", got {wrong['input']!r}" if is_shown else ""
    return f"{name or 'settings'}: {wrong['msg'].removeprefix('Value error, ')}{got}"


def own_effects_in_force() -> None:
    """From now on own effects are known, see service.own_effects; exit code 2 if one is wrong."""
    from core.errors import ModelError
    from service.own_effects import add_own_effects

    try:
        add_own_effects(settings_in_force().effects_folder)
    except ModelError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None
