"""The states of alerts, and the columns about them, in the words of the glossary: active, on hold."""

import sqlalchemy as sa
from alembic import op

revision = "0014_alert_words"
down_revision = "0013_without_credentials"
branch_labels = None
depends_on = None

COLUMNS = (
    ("alert", "inhibited_by", "held_by"),
    ("alert", "fired_at", "activated_at"),
    ("drift_value", "is_inhibited", "is_excluded"),
    ("drift_alarm", "is_firing", "is_sure"),
)
STATES = (("firing", "active"), ("inhibited", "on_hold"))


def upgrade() -> None:
    """Columns and states get their new names."""
    for table, before, after in COLUMNS:
        _rename(table, before, after)
    for before, after in STATES:
        _restate(before, after)


def downgrade() -> None:
    """They get their former names back."""
    for table, before, after in COLUMNS:
        _rename(table, after, before)
    for before, after in STATES:
        _restate(after, before)


def _rename(table: str, before: str, after: str) -> None:
    with op.batch_alter_table(table) as changed:
        changed.alter_column(before, new_column_name=after)


def _restate(before: str, after: str) -> None:
    for name in ("alert", "alert_change"):
        table = sa.table(name, sa.column("state", sa.String()))
        op.execute(table.update().where(table.c.state == before).values(state=after))
