"""`menshin key`: keys for the API, and links to one building."""

import getpass
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.database import transaction
from service.cli.inputs import current_settings
from service.documents.text import print_table

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

app = typer.Typer(no_args_is_help=True, help="Keys for the API, and links to one building.")

Name = Annotated[str, typer.Argument(help="name of the key: who or what uses it")]
RoleName = Annotated[
    str, typer.Option("--role", help="viewer (reads), engineer (also requests analyses and model work) or admin (all)")
]


Buildings = Annotated[
    list[str] | None,
    typer.Option("--building", help="code of a building that the key may see; may be repeated; default: all"),
]
Higher = Annotated[
    list[str] | None,
    typer.Option(
        "--on", metavar="CODE=ROLE", help="a higher role on one building, such as TWR=engineer; may be repeated"
    ),
]
Days = Annotated[int | None, typer.Option("--days", min=1, max=3650, help="days until the key expires; default: never")]


@app.command()
def create(
    context: typer.Context,
    name: Name,
    role: RoleName,
    building: Buildings = None,
    on: Higher = None,
    days: Days = None,
) -> None:
    """Create a key and print it; it cannot be shown again."""
    from service.access import keys
    from service.access.roles import Role

    if role not in Role.__members__:
        raise typer.BadParameter(
            f"{role!r} is not a role; the roles are {', '.join(Role.__members__)}", param_hint="--role"
        )
    now = datetime.now(UTC)
    end = None if days is None else now + timedelta(days=days)
    with _session(context) as session:
        higher = dict(map(keys.read_role, on or ()))
        key = keys.create(session, name, Role[role], now, buildings=building or None, higher=higher, expires_at=end)
    typer.echo(key)


@app.command("list")
def every(context: typer.Context) -> None:
    """List all keys, without their secret parts."""
    from service.access import keys

    with _session(context) as session:
        now, found = datetime.now(UTC), keys.every(session)
    rows = []
    for key in found:
        buildings = "all" if key.buildings is None else ", ".join(key.buildings)
        times = (
            keys.time_in_words(key.created_at),
            keys.time_in_words(key.used_at, "never"),
            keys.end_in_words(key, now),
        )
        rows.append((key.name, keys.roles_in_words(key), buildings, key.hash.partition(":")[0], *times))
    headers = ("name", "role", "buildings", "begins with", "created", "last used", "ends")
    print_table(headers, rows, title="Times are in UTC.")


@app.command()
def revoke(context: typer.Context, name: Name) -> None:
    """Revoke a key; this takes effect within a second."""
    from service.access import keys

    with _session(context) as session:
        keys.revoke(session, name, datetime.now(UTC))
    typer.echo(f"The key {name!r} is revoked.")


@app.command()
def link(
    context: typer.Context,
    code: Annotated[str, typer.Argument(help="code of the building")],
    name: Annotated[str, typer.Argument(help="person or purpose that the link is for")],
    days: Annotated[int, typer.Option(min=1, max=366, help="days until the link expires")] = 30,
) -> None:
    """Print a link with which anyone can read the pages of one building; it cannot be shown again."""
    from service.access import links
    from service.buildings.queries import building

    settings = current_settings()
    public = settings.public_url or f"http://{settings.host}:{settings.port}"
    with _session(context) as session:
        shown, _ = building(session, code)
        _, token = links.create(session, shown, name, getpass.getuser(), datetime.now(UTC), days)
    typer.echo(links.address(public, token))


@app.command("links")
def every_link(context: typer.Context) -> None:
    """List all links to buildings, without their secret parts."""
    from service.access import keys, links

    rows = []
    with _session(context) as session:
        now = datetime.now(UTC)
        for one in links.every(session):
            times = (keys.time_in_words(one.used_at, "never"), keys.end_in_words(one, now))
            begins_with = one.hash.partition(":")[0]
            rows.append((str(one.id), one.building.code, one.name, begins_with, one.created_by, *times))
    headers = ("number", "building", "for", "begins with", "made by", "last used", "ends")
    print_table(headers, rows, title="Times are in UTC.")


@app.command()
def unlink(
    context: typer.Context,
    number: Annotated[int, typer.Argument(min=1, help="number of the link, from 'menshin key links'")],
) -> None:
    """Revoke a link; this takes effect within a second."""
    from service.access import links

    with _session(context) as session:
        name = links.revoke(session, number, datetime.now(UTC)).name
    typer.echo(f"The link for {name!r} is revoked.")


@app.command("logout")
def log_out(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="name of a key, or person:NAME; default: all browsers")] = None,
) -> None:
    """Log out all browsers, or those of one key or of one person who signed in."""
    from service.access import keys

    with _session(context) as session:
        count = keys.log_out(session, name, datetime.now(UTC))
    typer.echo(f"{count} {'session was' if count == 1 else 'sessions were'} ended.")


@contextmanager
def _session(context: typer.Context) -> Iterator["Session"]:
    """A transaction on the database; a wrong name ends the command with exit code 1."""
    from service.errors import ConflictError, NotFoundError

    with transaction(context, ConflictError, NotFoundError) as session:
        yield session
