"""`menshin key`: keys for the API."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from service.cli.database import transaction

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

app = typer.Typer(no_args_is_help=True, help="Keys for the API.")

Name = Annotated[str, typer.Argument(help="name of the key: who or what uses it")]
RoleName = Annotated[
    str, typer.Option("--role", help="viewer (reads), engineer (also requests analyses and model work) or admin (all)")
]


@app.command()
def create(context: typer.Context, name: Name, role: RoleName) -> None:
    """Create a key and print it: it cannot be shown again."""
    from service.access import keys
    from service.access.roles import Role

    if role not in Role.__members__:
        raise typer.BadParameter(f"{role!r} is no role; {', '.join(Role.__members__)} are", param_hint="--role")
    with _session(context) as session:
        key = keys.create(session, name, Role[role], datetime.now(UTC))
    typer.echo(key)


@app.command("list")
def every(context: typer.Context) -> None:
    """List all keys, without their secret parts."""
    from service.access import keys

    table = Table("name", "role", "begins with", "created (UTC)", "revoked (UTC)")
    with _session(context) as session:
        rows = keys.every(session)
    for key in rows:
        revoked = "" if key.revoked_at is None else f"{key.revoked_at:%Y-%m-%d %H:%M}"
        table.add_row(key.name, key.role, key.hash.partition(":")[0], f"{key.created_at:%Y-%m-%d %H:%M}", revoked)
    Console().print(table)


@app.command()
def revoke(context: typer.Context, name: Name) -> None:
    """Revoke a key, within a second."""
    from service.access import keys

    with _session(context) as session:
        keys.revoke(session, name, datetime.now(UTC))
    typer.echo(f"The key {name!r} is revoked.")


@app.command("logout")
def log_out(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="name of one key; without it all browsers are logged out")] = None,
) -> None:
    """Log out all browsers, or those that used one key."""
    from service.access import keys

    with _session(context) as session:
        count = keys.log_out(session, name, datetime.now(UTC))
    typer.echo(f"{count} {'session was' if count == 1 else 'sessions were'} ended.")


@contextmanager
def _session(context: typer.Context) -> Iterator["Session"]:
    """A transaction on the database; a wrong name ends the command with exit code 1."""
    from service.access.keys import KeyNameError

    with transaction(context, KeyNameError) as session:
        yield session
