"""Strength of the earthquake and peaks of the floors, beside the other results of an analysis."""

import sqlalchemy as sa
from alembic import op

revision = "0022_shaking"
down_revision = "0021_parsed_descriptions"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table; earlier analyses have no row in it."""
    op.create_table(
        "shaking_result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("analysis_id", sa.Integer(), nullable=False),
        sa.Column("level", sa.String(), nullable=False),
        sa.Column("is_below_isolators", sa.Boolean(), nullable=False),
        sa.Column("components", sa.JSON(), nullable=False),
        sa.Column("pga", sa.Double(), nullable=False),
        sa.Column("pgv", sa.Double(), nullable=False),
        sa.Column("intensity", sa.Double(), nullable=True),
        sa.Column("long_period_velocity", sa.Double(), nullable=False),
        sa.Column("arias", sa.Double(), nullable=False),
        sa.Column("duration", sa.Double(), nullable=False),
        sa.Column("spectrum", sa.JSON(), nullable=False),
        sa.Column("floors", sa.JSON(), nullable=False),
        sa.Column("storeys", sa.JSON(), nullable=False),
        sa.Column("peak_floor_acceleration", sa.Double(), nullable=True),
        sa.Column("peak_storey_displacement", sa.Double(), nullable=True),
        sa.Column("travel", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["analysis_id"], ["analysis.id"], name=op.f("fk_shaking_result_analysis_id_analysis")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_shaking_result")),
        sa.UniqueConstraint("analysis_id", name=op.f("uq_shaking_result_analysis_id")),
    )


def downgrade() -> None:
    """Remove it."""
    op.drop_table("shaking_result")
