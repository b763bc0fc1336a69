"""The language in which a recipient gets messages."""

import sqlalchemy as sa
from alembic import op

revision = "0032_language_of_recipients"
down_revision = "0031_alert_comments"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; recipients from before get English, as they did."""
    with op.batch_alter_table("receiver") as table:
        table.add_column(sa.Column("language", sa.String(), nullable=False, server_default="en"))
    with op.batch_alter_table("receiver") as table:
        table.alter_column("language", server_default=None)


def downgrade() -> None:
    """Remove it."""
    with op.batch_alter_table("receiver") as table:
        table.drop_column("language")
