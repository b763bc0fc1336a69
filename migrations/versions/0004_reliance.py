"""How far the assumptions of a force's estimate held."""

import sqlalchemy as sa
from alembic import op

revision = "0004_reliance"
down_revision = "0003_mode_deviation"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Empty in the results that are there."""
    with op.batch_alter_table("direction_result") as table:
        table.add_column(sa.Column("reliance", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    """Without the new column."""
    with op.batch_alter_table("direction_result") as table:
        table.drop_column("reliance")
