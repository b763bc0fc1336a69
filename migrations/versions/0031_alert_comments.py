"""Comments on alerts, and the person to whom an alert is assigned."""

import sqlalchemy as sa
from alembic import op

revision = "0031_alert_comments"
down_revision = "0030_inspections"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table and the column."""
    op.create_table(
        "alert_comment",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("alert_id", sa.Integer(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
        sa.Column("assigned_to", sa.String(), nullable=True),
        sa.ForeignKeyConstraint(["alert_id"], ["alert.id"], name=op.f("fk_alert_comment_alert_id_alert")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alert_comment")),
    )
    op.create_index(op.f("ix_alert_comment_alert_id"), "alert_comment", ["alert_id"])
    with op.batch_alter_table("alert") as table:
        table.add_column(sa.Column("assigned_to", sa.String(), nullable=True))


def downgrade() -> None:
    """Remove them."""
    with op.batch_alter_table("alert") as table:
        table.drop_column("assigned_to")
    op.drop_table("alert_comment")
