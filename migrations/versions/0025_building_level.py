"""Levels of the buildings, by which lists of buildings are sorted."""

import sqlalchemy as sa
from alembic import op

revision = "0025_building_level"
down_revision = "0024_sign_in"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table; the periodic checks fill it when they next run."""
    op.create_table(
        "building_level",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("level", sa.String(), nullable=False),
        sa.Column("rank", sa.Integer(), nullable=False),
        sa.Column("latitude", sa.Double(), nullable=True),
        sa.Column("longitude", sa.Double(), nullable=True),
        sa.Column("assessed_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_building_level_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", name=op.f("pk_building_level")),
    )
    op.create_index(op.f("ix_building_level_rank"), "building_level", ["rank"])


def downgrade() -> None:
    """Remove it."""
    op.drop_table("building_level")
