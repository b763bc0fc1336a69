"""Keys of some buildings, with an end and a last use."""

import sqlalchemy as sa
from alembic import op

revision = "0023_key_limits"
down_revision = "0022_shaking"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns."""
    with op.batch_alter_table("api_key") as table:
        table.add_column(sa.Column("buildings", sa.JSON(none_as_null=True), nullable=True))
        table.add_column(sa.Column("expires_at", sa.DateTime(timezone=True), nullable=True))
        table.add_column(sa.Column("used_at", sa.DateTime(timezone=True), nullable=True))


def downgrade() -> None:
    """Remove them, and revoke keys with a limit, which would otherwise lose it."""
    op.execute("UPDATE api_key SET revoked_at = created_at WHERE buildings IS NOT NULL OR expires_at IS NOT NULL")
    with op.batch_alter_table("api_key") as table:
        for name in ("used_at", "expires_at", "buildings"):
            table.drop_column(name)
