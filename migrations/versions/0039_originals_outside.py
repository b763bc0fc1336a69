"""Original files outside the database, and when and by which rule deleted ones were deleted."""

import sqlalchemy as sa
from alembic import op

revision = "0039_originals_outside"
down_revision = "0038_building_checks"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; all bytes are in the database."""
    op.add_column("content", sa.Column("is_outside", sa.Boolean(), server_default=sa.false(), nullable=False))
    op.add_column("content", sa.Column("deleted_at", sa.DateTime(timezone=True), nullable=True))
    op.add_column("content", sa.Column("deleted_by", sa.String(), nullable=True))


def downgrade() -> None:
    """Remove them.

    Raises:
        RuntimeError: some bytes are outside the database, where an earlier version does not look for them.
    """
    if op.get_bind().scalar(sa.text("SELECT count(*) FROM content WHERE is_outside")):
        raise RuntimeError("original files are outside the database; run `menshin storage move --to-database` first")
    for name in ("deleted_by", "deleted_at", "is_outside"):
        op.drop_column("content", name)
