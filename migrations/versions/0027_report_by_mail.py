"""Recipients of mail that get the report on an earthquake with it."""

import sqlalchemy as sa
from alembic import op

revision = "0027_report_by_mail"
down_revision = "0026_chart_specs"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; recipients from before get no report."""
    with op.batch_alter_table("receiver") as table:
        table.add_column(sa.Column("with_report", sa.Boolean(), nullable=False, server_default=sa.false()))
    with op.batch_alter_table("receiver") as table:
        table.alter_column("with_report", server_default=None)


def downgrade() -> None:
    """Remove it."""
    with op.batch_alter_table("receiver") as table:
        table.drop_column("with_report")
