"""The largest recorded acceleration of an earthquake, by which those that wait are analysed."""

import sqlalchemy as sa
from alembic import op

revision = "0035_recorded_peak"
down_revision = "0034_streams"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; earthquakes that were stored before have none, and come last."""
    with op.batch_alter_table("event") as table:
        table.add_column(sa.Column("recorded_peak", sa.Double(), nullable=True))


def downgrade() -> None:
    """Remove it."""
    with op.batch_alter_table("event") as table:
        table.drop_column("recorded_peak")
