"""Sketched laws that are kept as effects."""

import sqlalchemy as sa
from alembic import op

revision = "0036_kept_effects"
down_revision = "0035_recorded_peak"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "kept_effect",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("law", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("building", sa.String(), nullable=False),
        sa.Column("model_id", sa.Integer(), nullable=False),
        sa.Column("job_id", sa.Integer(), nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_kept_effect")),
        sa.UniqueConstraint("name", name=op.f("uq_kept_effect_name")),
    )


def downgrade() -> None:
    """Remove it."""
    op.drop_table("kept_effect")
