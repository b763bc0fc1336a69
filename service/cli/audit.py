"""Sessions of a command: what it changes is told to the audit trail, with who gave it."""

import getpass
import socket
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from sqlalchemy.orm import Session, sessionmaker


def of_command(context: typer.Context, sessions: "sessionmaker[Session]") -> "sessionmaker[Session]":
    """The same sessions; the first change is told, with the account that gave the command: a command is one deed."""
    from service.access.auditing import Deed, audited

    told = False

    def deed() -> Deed | None:
        nonlocal told
        if told:
            return None
        told = True
        details = {name: str(value) for name, value in context.params.items() if value is not None}
        return Deed(getpass.getuser(), socket.gethostname(), context.command_path, "", details)

    return audited(sessions, deed)
