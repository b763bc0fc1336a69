"""Inspections of buildings, whether an alert is open or not."""

import sqlalchemy as sa
from alembic import op

revision = "0030_inspections"
down_revision = "0029_building_links"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "building_inspection",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("inspected_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("recorded_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("result", sa.String(), nullable=False),
        sa.Column("comment", sa.Text(), nullable=False),
        sa.Column("level", sa.String(), nullable=False),
        sa.Column("headline", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["building_id"], ["building.id"], name=op.f("fk_building_inspection_building_id_building")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_building_inspection")),
    )
    op.create_index(
        op.f("ix_building_inspection_building_id_inspected_at"), "building_inspection", ["building_id", "inspected_at"]
    )


def downgrade() -> None:
    """Remove it."""
    op.drop_table("building_inspection")
