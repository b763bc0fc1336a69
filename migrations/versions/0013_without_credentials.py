"""Passwords and tokens of sources go from every table that is shown."""

import re
from collections.abc import Callable
from typing import Any

import sqlalchemy as sa
from alembic import op

from service.shown_addresses import without_credentials

revision = "0013_without_credentials"
down_revision = "0012_reference_subject"
branch_labels = None
depends_on = None

SHOWN = {
    "recording": ("origin", "reason"),
    "alert": ("summary", "sentences", "evidence"),
    "alert_change": ("summary", "evidence"),
    "message": ("subject", "sentences", "facts", "data"),
}
"""Columns that may repeat the address of a source."""
JSON = {"sentences", "evidence", "facts", "data", "cursor"}
USER_INFO = re.compile(r"://[^/?#\s]*@")


def upgrade() -> None:
    """Cut the addresses down; those that tell files apart lose the password only, or every file would come again."""
    _shorten_names()
    for table, columns in SHOWN.items():
        _rewrite(table, "id", columns, without_credentials)
    _rewrite("source_state", "building_id", ("error",), without_credentials)
    _rewrite("source_state", "building_id", ("cursor",), _without_login)
    _rewrite("fetched_file", "address", ("address",), _without_login)


def downgrade() -> None:
    """What was taken away does not come back, and nothing misses it."""


def _shorten_names() -> None:
    """A file's name was the end of its address, with the query; its reason repeats it."""
    text = (sa.column(name, sa.Text) for name in ("name", "reason", "origin"))
    recording = sa.table("recording", sa.column("id", sa.Integer), *text)
    queried = sa.select(recording).where(recording.c.origin.like("%://%?%"), recording.c.name.like("%?%"))
    for row in op.get_bind().execute(queried).all():
        name = row.name.partition("?")[0]
        reason = None if row.reason is None else row.reason.replace(row.name, name)
        op.get_bind().execute(sa.update(recording).where(recording.c.id == row.id).values(name=name, reason=reason))


def _rewrite(name: str, key: str, columns: tuple[str, ...], rewritten: Callable[[str], str]) -> None:
    """Rewrite every address in these columns."""
    typed = [sa.column(column, sa.JSON if column in JSON else sa.Text) for column in columns]
    table = sa.table(name, *([] if key in columns else [sa.column(key)]), *typed)
    where = sa.or_(*(sa.cast(column, sa.Text).like("%://%") for column in typed))
    for row in op.get_bind().execute(sa.select(table).where(where)).mappings().all():
        before = {column: row[column] for column in columns}
        after = {column: _mapped(value, rewritten) for column, value in before.items()}
        if after != before:
            op.get_bind().execute(sa.update(table).where(table.c[key] == row[key]).values(**after))


def _mapped(value: Any, rewritten: Callable[[str], str]) -> Any:  # noqa: ANN401  whatever JSON may hold
    if isinstance(value, str):
        return rewritten(value)
    if isinstance(value, dict):
        return {rewritten(name): _mapped(member, rewritten) for name, member in value.items()}
    return [_mapped(member, rewritten) for member in value] if isinstance(value, list) else value


def _without_login(text: str) -> str:
    return USER_INFO.sub("://", text)
