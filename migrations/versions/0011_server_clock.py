"""By how much a monitoring server's clock is ahead of ours."""

import sqlalchemy as sa
from alembic import op

revision = "0011_server_clock"
down_revision = "0010_watching"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """One more column."""
    with op.batch_alter_table("source_state") as table:
        table.add_column(sa.Column("clock_ahead", sa.Double(), nullable=True))


def downgrade() -> None:
    """It goes."""
    with op.batch_alter_table("source_state") as table:
        table.drop_column("clock_ahead")
