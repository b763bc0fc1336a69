"""`menshin secret`: the key that encrypts secrets in the database."""

from typing import TYPE_CHECKING

import typer

from service.cli.database import transaction
from service.cli.inputs import USAGE, end

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

app = typer.Typer(no_args_is_help=True, help="The key that encrypts secrets in the database.")


@app.command("new-key")
def new_key() -> None:
    """Print a new random key for the environment variable MENSHIN_SECRET_KEY; nothing else changes."""
    from service.db import encryption

    typer.echo(encryption.new_key())


@app.command()
def encrypt(context: typer.Context) -> None:
    """Encrypt every secret in the database with the first key in MENSHIN_SECRET_KEY.

    Run it after setting the key for the first time, and after putting a new key before the old one.
    """
    from service.db import encryption

    if not encryption.is_key_set():
        end(f"{encryption.VARIABLE} is not set; `menshin secret new-key` prints a key for it.", USAGE)
    with transaction(context) as session:
        count = _rewrite(session)
    typer.echo(f"{count} secrets are encrypted with the first key in {encryption.VARIABLE}.")


def _rewrite(session: "Session") -> int:
    """Read every secret and write it again; the number of secrets."""
    from sqlalchemy import select
    from sqlalchemy.orm.attributes import flag_modified

    from service.buildings.tables import Revision
    from service.notify.tables import Receiver

    count = 0
    for table, names in ((Receiver, ("address", "secret")), (Revision, ("toml", "parsed"))):
        for row in session.scalars(select(table)):
            for name in names:
                if getattr(row, name) is not None:
                    flag_modified(row, name)
                    count += name != "parsed"  # holds the secrets of the file once more
    return count
