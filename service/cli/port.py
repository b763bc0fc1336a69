"""The port that a command is about to serve at: that it can be had is known before anything else begins."""

import errno
import socket
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from service.settings import Settings

CANNOT = 1


def check_port(settings: "Settings") -> None:
    """End the command with a reason and exit code 1 if nothing can be served at the host and port of the settings."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    try:
        socket.create_server((settings.host, settings.port), family=family).close()
    except OSError as error:
        typer.echo(wrong_port(settings.host, settings.port, error), err=True)
        raise typer.Exit(CANNOT) from None


def wrong_port(host: str, port: int, error: OSError) -> str:
    """Why nothing can be served there, and what helps."""
    another = "choose another by MENSHIN_PORT or --port"
    if error.errno == errno.EADDRINUSE:
        return f"port {port} of {host} is taken by another process; end that one, or {another}"
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"this account may not listen at port {port} of {host}; {another}, of 1024 or more"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{host} is not an address of this machine; correct MENSHIN_HOST: 127.0.0.1 and 0.0.0.0 always are"
    if isinstance(error, socket.gaierror):
        return f"the host {host!r} is not known; correct MENSHIN_HOST: 127.0.0.1 and 0.0.0.0 are always there"
    return f"nothing can be served at port {port} of {host}: {error.strerror or error}; {another}"
