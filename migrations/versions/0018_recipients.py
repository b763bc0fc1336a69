"""Why a message went to nobody, and since when a receiver is reached where it is."""

import sqlalchemy as sa
from alembic import op

revision = "0018_recipients"
down_revision = "0017_logins"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Two columns; why earlier messages went to nobody is not known any more."""
    with op.batch_alter_table("message") as table:
        table.add_column(sa.Column("unsent", sa.Text(), nullable=True))
    with op.batch_alter_table("receiver") as table:
        table.add_column(sa.Column("since", sa.DateTime(timezone=True), nullable=True))
    op.execute(
        "UPDATE message SET unsent = 'no recipients for it' "
        "WHERE NOT EXISTS (SELECT 1 FROM delivery WHERE delivery.message_id = message.id)"
    )


def downgrade() -> None:
    """They go."""
    with op.batch_alter_table("receiver") as table:
        table.drop_column("since")
    with op.batch_alter_table("message") as table:
        table.drop_column("unsent")
