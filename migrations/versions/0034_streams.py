"""Live streams: their packets, and the state of each."""

import sqlalchemy as sa
from alembic import op

revision = "0034_streams"
down_revision = "0033_recorded_channels"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables."""
    op.create_table(
        "packet",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("station", sa.String(), nullable=False),
        sa.Column("sequence", sa.BigInteger(), nullable=True),
        sa.Column("channel", sa.String(), nullable=False),
        sa.Column("start", sa.DateTime(timezone=True), nullable=False),
        sa.Column("end", sa.DateTime(timezone=True), nullable=False),
        sa.Column("received_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("sha256", sa.String(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_packet_building_id_building")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_packet")),
        sa.UniqueConstraint("building_id", "sha256", name=op.f("uq_packet_building_id_sha256")),
    )
    op.create_index(op.f("ix_packet_building_id_end"), "packet", ["building_id", "end"])
    op.create_table(
        "stream_state",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("protocol", sa.String(), nullable=True),
        sa.Column("connected_since", sa.DateTime(timezone=True), nullable=True),
        sa.Column("received_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("packets", sa.BigInteger(), nullable=False),
        sa.Column("doubles", sa.BigInteger(), nullable=False),
        sa.Column("refused", sa.BigInteger(), nullable=False),
        sa.Column("problem", sa.Text(), nullable=True),
        sa.Column("channels", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("looked", sa.BigInteger(), nullable=False),
        sa.Column("shaking", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("cuts", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_stream_state_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", name=op.f("pk_stream_state")),
    )


def downgrade() -> None:
    """Remove them."""
    op.drop_table("stream_state")
    op.drop_table("packet")
