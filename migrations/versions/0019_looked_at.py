"""When a look at a source last brought something, or ended."""

import sqlalchemy as sa
from alembic import op

revision = "0019_looked_at"
down_revision = "0018_recipients"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """One more column, filled with the last success."""
    with op.batch_alter_table("source_state") as table:
        table.add_column(sa.Column("looked_at", sa.DateTime(timezone=True), nullable=True))
    op.execute("UPDATE source_state SET looked_at = succeeded_at")


def downgrade() -> None:
    """It goes."""
    with op.batch_alter_table("source_state") as table:
        table.drop_column("looked_at")
