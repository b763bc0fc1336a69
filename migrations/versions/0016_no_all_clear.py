"""No message is an all-clear: whether its subject has ended is a column, and the lowest severity is `normal`.

Messages that were stored as an all-clear become notes: that nothing was open or undecided then is not known.
"""

from collections.abc import Mapping

import sqlalchemy as sa
from alembic import op

revision = "0016_no_all_clear"
down_revision = "0015_alert_parts"
branch_labels = None
depends_on = None

RECEIVER = sa.table("receiver", sa.column("id", sa.Integer), sa.column("severities", sa.JSON))


def upgrade() -> None:
    """The column is filled from what it replaces."""
    with op.batch_alter_table("message") as table:
        table.add_column(sa.Column("is_over", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.execute("UPDATE message SET is_over = true WHERE severity = 'all_clear' OR sequence = 'cancelled'")
    op.execute("UPDATE message SET severity = 'note' WHERE severity = 'all_clear'")
    with op.batch_alter_table("message") as table:
        table.alter_column("is_over", server_default=None)
    _rename({"all_clear": "normal"})


def downgrade() -> None:
    """What is over becomes an all-clear again."""
    op.execute("UPDATE message SET severity = 'all_clear' WHERE is_over AND sequence <> 'cancelled'")
    op.execute("UPDATE message SET severity = 'all_clear' WHERE severity = 'normal'")
    with op.batch_alter_table("message") as table:
        table.drop_column("is_over")
    _rename({"normal": "all_clear"})


def _rename(names: Mapping[str, str]) -> None:
    connection = op.get_bind()
    for number, severities in connection.execute(sa.select(RECEIVER.c.id, RECEIVER.c.severities)).all():
        renamed = [names.get(one, one) for one in severities]
        if renamed != severities:
            connection.execute(sa.update(RECEIVER).where(RECEIVER.c.id == number).values(severities=renamed))
