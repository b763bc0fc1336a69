"""Links by which whoever has one reads the pages of one building."""

import sqlalchemy as sa
from alembic import op

revision = "0029_building_links"
down_revision = "0028_roles_of_keys"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "building_link",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("hash", sa.String(), nullable=False),
        sa.Column("created_by", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revoked_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("used_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_building_link_building_id_building")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_building_link")),
        sa.UniqueConstraint("hash", name=op.f("uq_building_link_hash")),
    )
    op.create_index(op.f("ix_building_link_building_id"), "building_link", ["building_id"])


def downgrade() -> None:
    """Remove it."""
    op.drop_table("building_link")
