"""Browser sessions of people whom a sign-in provider identifies."""

import sqlalchemy as sa
from alembic import op

revision = "0024_sign_in"
down_revision = "0023_key_limits"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns of a person's session."""
    with op.batch_alter_table("login_session") as table:
        for name in ("issuer", "person", "sign_in"):
            table.add_column(sa.Column(name, sa.String(), nullable=True))
        table.add_column(sa.Column("groups", sa.JSON(none_as_null=True), nullable=True))
        table.add_column(sa.Column("expires_at", sa.DateTime(timezone=True), nullable=True))
        table.create_unique_constraint(op.f("uq_login_session_sign_in"), ["sign_in"])


def downgrade() -> None:
    """Remove them, and with them the sessions of people, which would otherwise count as an admin's."""
    op.execute("DELETE FROM login_session WHERE issuer IS NOT NULL")
    with op.batch_alter_table("login_session") as table:
        table.drop_constraint(op.f("uq_login_session_sign_in"), type_="unique")
        for name in ("issuer", "person", "sign_in", "groups", "expires_at"):
            table.drop_column(name)
