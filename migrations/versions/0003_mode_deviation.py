"""How well the shape of a mode is known, and how well the model behind it fits."""

import sqlalchemy as sa
from alembic import op

revision = "0003_mode_deviation"
down_revision = "0002_layer_motion"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """New columns are empty in the results that are there."""
    with op.batch_alter_table("mode_result") as table:
        table.add_column(sa.Column("shape_std", sa.JSON(none_as_null=True), nullable=True))
        table.add_column(sa.Column("misfit", sa.Double(), nullable=True))


def downgrade() -> None:
    """Without the new columns."""
    with op.batch_alter_table("mode_result") as table:
        table.drop_column("misfit")
        table.drop_column("shape_std")
