"""Results of each building's last periodic check, so that a poller that starts need not check all buildings."""

import sqlalchemy as sa
from alembic import op

revision = "0038_building_checks"
down_revision = "0037_lease_trouble"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table; the periodic checks fill it when they next run."""
    op.create_table(
        "building_check",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("checked_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("facts", sa.String(), nullable=False),
        sa.Column("has_source", sa.Boolean(), nullable=False),
        sa.Column("is_continuous", sa.Boolean(), nullable=False),
        sa.Column("described_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_building_check_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", name=op.f("pk_building_check")),
    )


def downgrade() -> None:
    """Remove it."""
    op.drop_table("building_check")
