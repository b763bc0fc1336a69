"""State from which the monitoring of a building's drift goes on after one more earthquake."""

import sqlalchemy as sa
from alembic import op

revision = "0041_drift_state"
down_revision = "0039_originals_outside"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table; the next monitoring of each building fills it."""
    op.create_table(
        "drift_state",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("facts", sa.String(), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_drift_state_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", name=op.f("pk_drift_state")),
    )


def downgrade() -> None:
    """Remove it."""
    op.drop_table("drift_state")
