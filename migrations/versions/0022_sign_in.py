"""Keys of some buildings with an end and a last use, people of a sign-in provider, and links to one building."""

import sqlalchemy as sa
from alembic import op

revision = "0022_sign_in"
down_revision = "0021_parsed_descriptions"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns of keys and browser sessions, and the table of links."""
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
    with op.batch_alter_table("api_key") as table:
        table.add_column(sa.Column("buildings", sa.JSON(none_as_null=True), nullable=True))
        table.add_column(sa.Column("expires_at", sa.DateTime(timezone=True), nullable=True))
        table.add_column(sa.Column("used_at", sa.DateTime(timezone=True), nullable=True))
    with op.batch_alter_table("login_session") as table:
        table.add_column(sa.Column("link_id", sa.Integer(), nullable=True))
        table.add_column(sa.Column("person", sa.String(), nullable=True))
        table.add_column(sa.Column("groups", sa.JSON(none_as_null=True), nullable=True))
        table.create_index(op.f("ix_login_session_link_id"), ["link_id"])
        table.create_foreign_key(
            op.f("fk_login_session_link_id_building_link"), "building_link", ["link_id"], ["id"], ondelete="CASCADE"
        )


def downgrade() -> None:
    """Remove them, and with them the sessions of people and links, which would otherwise count as an admin's."""
    op.execute("DELETE FROM login_session WHERE person IS NOT NULL OR link_id IS NOT NULL")
    op.execute("UPDATE api_key SET revoked_at = created_at WHERE buildings IS NOT NULL OR expires_at IS NOT NULL")
    with op.batch_alter_table("login_session") as table:
        table.drop_constraint(op.f("fk_login_session_link_id_building_link"), type_="foreignkey")
        table.drop_index(op.f("ix_login_session_link_id"))
        for name in ("groups", "person", "link_id"):
            table.drop_column(name)
    with op.batch_alter_table("api_key") as table:
        for name in ("used_at", "expires_at", "buildings"):
            table.drop_column(name)
    op.drop_index(op.f("ix_building_link_building_id"), "building_link")
    op.drop_table("building_link")
