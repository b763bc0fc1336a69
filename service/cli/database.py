"""A command's access to the database, brought up to date first; every change is on the audit trail."""

import getpass
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from service.cli.inputs import REFUSED, current_settings, end

if TYPE_CHECKING:
    from sqlalchemy.orm import Session, sessionmaker


@contextmanager
def transaction(context: typer.Context, *refusals: type[Exception]) -> Iterator["Session"]:
    """A transaction of a command.

    Args:
        context: of the command, for the audit trail.
        refusals: errors that end the command with their text and exit code 1.
    """
    with opened(context) as sessions:
        try:
            with sessions.begin() as session:
                yield session
        except refusals as error:
            end(str(error), REFUSED)


@contextmanager
def opened(context: typer.Context) -> Iterator["sessionmaker[Session]"]:
    """Sessions of a command."""
    from service.db.migrate import upgrade
    from service.db.sessions import sessions

    url = current_settings().database_url
    upgrade(url)
    made = sessions(url)
    try:
        yield _audited(context, made)
    finally:
        made.kw["bind"].dispose()


def _audited(context: typer.Context, sessions: "sessionmaker[Session]") -> "sessionmaker[Session]":
    """The same sessions; the first change adds the command to the audit trail, with the account that gave it."""
    from service.access.auditing import AuditContext, audited

    is_noted = False

    def audit_context() -> AuditContext | None:
        nonlocal is_noted
        if is_noted:
            return None
        is_noted = True
        given = {name: value for name, value in context.params.items() if value not in (None, (), [])}
        details = {
            name: ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
            for name, value in given.items()
        }
        return AuditContext(getpass.getuser(), socket.gethostname(), context.command_path, "", details)

    return audited(sessions, audit_context)
