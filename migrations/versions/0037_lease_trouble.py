"""Reason why a process waits, such as a worker whose Dask cluster is away."""

import sqlalchemy as sa
from alembic import op

revision = "0037_lease_trouble"
down_revision = "0036_kept_effects"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    with op.batch_alter_table("lease") as table:
        table.add_column(sa.Column("trouble", sa.Text(), nullable=True))


def downgrade() -> None:
    """Remove it."""
    with op.batch_alter_table("lease") as table:
        table.drop_column("trouble")
