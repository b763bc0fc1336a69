"""Browsers that are logged in, and links that log in once."""

import sqlalchemy as sa
from alembic import op

revision = "0017_logins"
down_revision = "0016_no_all_clear"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Two tables; browsers that kept an API key as their cookie log in anew."""
    op.create_table(
        "login_session",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("hash", sa.String(), nullable=False),
        sa.Column("key_id", sa.Integer(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("used_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(
            ["key_id"], ["api_key.id"], name=op.f("fk_login_session_key_id_api_key"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_login_session")),
        sa.UniqueConstraint("hash", name=op.f("uq_login_session_hash")),
    )
    op.create_index(op.f("ix_login_session_key_id"), "login_session", ["key_id"])
    op.create_table(
        "login_link",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("hash", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("used_at", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_login_link")),
        sa.UniqueConstraint("hash", name=op.f("uq_login_link_hash")),
    )


def downgrade() -> None:
    """They go: browsers log in anew."""
    op.drop_table("login_link")
    op.drop_index(op.f("ix_login_session_key_id"), "login_session")
    op.drop_table("login_session")
