"""Error messages of commands: one or two lines with the problem and its remedy.

A bug is the exception: its traceback goes into a file, or to where the log of a service goes, and a line says so.
"""

import atexit
import errno
import gc
import os
import sys
import tempfile
import traceback
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import typer
from typer.core import TyperGroup

from service.process import GARBAGE, ONE_THREAD

CANNOT, BUG = 1, 70
"""Exit codes: an error that a user can remedy; a bug (EX_SOFTWARE of sysexits.h)."""
NO_PLUGINS = ("PYDANTIC_DISABLE_PLUGINS", "__all__")
"""Keeps Pydantic from searching all installed packages for plugins, unless a user has set it."""
HELPS: Mapping[int, str] = {
    errno.EACCES: "give this account access to it, or name another path",
    errno.EPERM: "give this account access to it, or name another path",
    errno.ENOENT: "create it, or correct the path",
    errno.ENOTDIR: "a part of the path is a file; correct the path",
    errno.EISDIR: "name a file",
    errno.EEXIST: "name another path, or move the file away",
    errno.ENOSPC: "free some space on the disk",
    errno.EDQUOT: "free some of the quota",
    errno.EROFS: "the file system is read-only; name a path on another one",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
    errno.EADDRINUSE: "another process listens at this port; end it, or choose another port by MENSHIN_PORT or --port",
    errno.ECONNREFUSED: "check the address, and that the server runs",
}


class Edge(TyperGroup):
    """The group of all commands."""

    def main(self, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401  as typer has it
        """Run a command; an error ends it with a message and an exit code other than 0."""
        os.environ.update(ONE_THREAD | os.environ)  # before NumPy is loaded; who set another number keeps it
        os.environ.setdefault(*NO_PLUGINS)
        gc.set_threshold(*GARBAGE)
        atexit.register(gc.freeze)  # the system takes the memory back: no last search through all modules
        try:
            warn_of_names()
            return super().main(*args, **kwargs)
        except Exception as error:  # the one place that separates bugs from other errors
            message = words(error)
            typer.echo(message or _bug_report(error), err=True)
            sys.exit(CANNOT if message else BUG)


def warn_of_names() -> None:
    """Warn about environment variables that look like settings but are not, and about old names."""
    if not any(name.startswith("MENSHIN_") for name in os.environ) and not os.path.isfile("menshin.toml"):
        return  # the settings take long to load
    from service.settings import old_names, settings_file, unknown_variables

    lines = unknown_variables(os.environ)
    with suppress(OSError, ValueError):  # a file that cannot be read stops the commands that need it
        lines += old_names(os.environ, settings_file())
    for line in lines:
        typer.echo(f"warning: {line}", err=True)


def words(error: BaseException) -> str | None:
    """The problem and its remedy; None for a bug."""
    from sqlalchemy.exc import SQLAlchemyError

    from core.errors import CoreError
    from service.db.encryption import SecretKeyError
    from service.db.problems import DatabaseVersionError, problem
    from service.errors import StoreAwayError
    from service.records.file_store import LostFileError
    from service.tracing import NoTracesError

    if isinstance(error, SQLAlchemyError):
        return problem(error)
    if isinstance(
        error, DatabaseVersionError | SecretKeyError | CoreError | NoTracesError | StoreAwayError | LostFileError
    ):
        return str(error)
    if isinstance(error, UnicodeDecodeError):
        return f"a file is not text in UTF-8 ({error.reason} at byte {error.start}); save it as UTF-8, or name another"
    return _system_error(error) if isinstance(error, OSError) else None


def _system_error(error: OSError) -> str | None:
    if error.errno is None:
        return str(error) or None
    reason = error.strerror or str(error)
    where = "" if error.filename is None else f"{os.fsdecode(error.filename)}: "
    helps = HELPS.get(error.errno)
    return f"{where}{reason}" + (f"; {helps}" if helps else "")


def _bug_report(error: Exception) -> str:
    """A line about a bug; its traceback goes into a file or the log."""
    text = "".join(traceback.format_exception(error))
    reason = f"menshin stopped because of a bug ({type(error).__name__})"
    if not sys.stderr.isatty():
        return f"{text}{reason}; the lines above show where"
    with tempfile.NamedTemporaryFile("w", prefix="menshin-bug-", suffix=".txt", delete=False) as file:
        file.write(text)
    return f"{reason}; {file.name} shows where: please report it"
