"""`menshin drill`: a test message through the whole delivery path."""

from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.database import opened

if TYPE_CHECKING:
    from sqlalchemy.orm import Session, sessionmaker

    from service.notify.schema import DeliveryRow

app = typer.Typer(no_args_is_help=True)

LOOK = 0.2
"""s between two queries for its deliveries."""
UNTAKEN = "no notifier is running; `menshin notify` or `menshin up` starts one"


@app.command()
def drill(
    context: typer.Context,
    building: Annotated[str, typer.Option(help="Code of the building.")],
    wait: Annotated[float, typer.Option(min=0, help="Seconds to wait for it to arrive.")] = 60.0,
) -> None:
    """Send a drill to every recipient of drills, through the outbox and the running notifier.

    Every channel marks it as a test. Exit code 0: it reached every recipient in time; 1: it did not.
    """
    import getpass
    from datetime import UTC, datetime

    from service.buildings.store import BuildingError, find
    from service.documents.text import print_table
    from service.errors import TooManyRequestsError
    from service.notify.drill import drill as put_drill

    with opened(context) as sessions:
        try:
            with sessions.begin() as session:
                number = put_drill(session, find(session, building), getpass.getuser(), datetime.now(UTC)).id
        except (BuildingError, TooManyRequestsError) as error:
            raise typer.BadParameter(str(error)) from None
        rows = _awaited(sessions, number, wait)
    if rows:
        shown = [(row.receiver_name, row.receiver_kind, row.state, row.last_answer or UNTAKEN) for row in rows]
        print_table(("receiver", "kind", "state", "answer"), shown)
    else:
        typer.echo(f"{building} has no recipient of drills")
    raise typer.Exit(0 if rows and all(row.state == "delivered" for row in rows) else 1)


def _awaited(sessions: "sessionmaker[Session]", number: int, seconds: float) -> "list[DeliveryRow]":
    """The deliveries of a message once each has ended, or the time is over."""
    from time import monotonic, sleep

    from service.db.sessions import reading
    from service.notify import queries as notify_queries
    from service.notify.schema import delivery_rows

    end = monotonic() + seconds
    while True:
        with reading(sessions)() as session:
            rows = delivery_rows(session, notify_queries.message(session, number).deliveries)
        if monotonic() > end or not any(row.state in ("waiting", "sending") for row in rows):
            return rows
        sleep(LOOK)
