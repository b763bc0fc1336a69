"""Channels of a live stream that are silent while others send: they raise an alert."""

import sqlalchemy as sa
from alembic import op

revision = "0045_silent_channels"
down_revision = "0044_plain_names"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; the next packet of a stream fills it in."""
    op.add_column("stream_state", sa.Column("silent", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    """Remove it."""
    with op.batch_alter_table("stream_state") as table:
        table.drop_column("silent")
