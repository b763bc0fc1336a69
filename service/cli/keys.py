"""`menshin key`: keys for the API."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
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


Buildings = Annotated[
    list[str] | None,
    typer.Option("--building", help="code of a building that the key may see; repeat for more; without it all"),
]
Days = Annotated[int | None, typer.Option("--days", min=1, max=3650, help="days until the key ends; without it never")]


@app.command()
def create(context: typer.Context, name: Name, role: RoleName, building: Buildings = None, days: Days = None) -> None:
    """Create a key and print it: it cannot be shown again."""
    from service.access import keys
    from service.access.roles import Role

    if role not in Role.__members__:
        raise typer.BadParameter(f"{role!r} is no role; {', '.join(Role.__members__)} are", param_hint="--role")
    now = datetime.now(UTC)
    end = None if days is None else now + timedelta(days=days)
    with _session(context) as session:
        key = keys.create(session, name, Role[role], now, buildings=building or None, expires_at=end)
    typer.echo(key)


@app.command("list")
def every(context: typer.Context) -> None:
    """List all keys, without their secret parts."""
    from service.access import keys

    table = Table("name", "role", "buildings", "begins with", "created", "last used", "ends", title="Times are in UTC.")
    with _session(context) as session:
        now, rows = datetime.now(UTC), keys.every(session)
    for key in rows:
        buildings = "all" if key.buildings is None else ", ".join(key.buildings)
        times = (
            keys.time_in_words(key.created_at),
            keys.time_in_words(key.used_at, "never"),
            keys.end_in_words(key, now),
        )
        table.add_row(key.name, key.role, buildings, key.hash.partition(":")[0], *times)
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
