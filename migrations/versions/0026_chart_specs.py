"""Charts of diagnoses as specifications, which pages draw live; earlier ones stay pictures."""

import sqlalchemy as sa
from alembic import op

revision = "0026_chart_specs"
down_revision = "0025_building_level"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; a picture is one or the other."""
    with op.batch_alter_table("diagnosis_picture") as table:
        table.add_column(sa.Column("spec", sa.JSON(none_as_null=True), nullable=True))
        table.alter_column("svg", existing_type=sa.Text(), nullable=True)


def downgrade() -> None:
    """Remove it, with the charts that have no picture."""
    op.execute("DELETE FROM diagnosis_picture WHERE svg IS NULL")
    with op.batch_alter_table("diagnosis_picture") as table:
        table.alter_column("svg", existing_type=sa.Text(), nullable=False)
        table.drop_column("spec")
