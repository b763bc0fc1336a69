"""How sensors did in each event, and how warm it was."""

import sqlalchemy as sa
from alembic import op

revision = "0009_sensors"
down_revision = "0008_alerts"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Of events that were analysed before, neither is known until they are analysed again."""
    with op.batch_alter_table("analysis") as table:
        table.add_column(sa.Column("temperature", sa.Double(), nullable=True))
    op.create_table(
        "sensor_result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("analysis_id", sa.Integer(), nullable=False),
        sa.Column("channel", sa.String(), nullable=False),
        sa.Column("noise", sa.Double(), nullable=True),
        sa.Column("gain", sa.Double(), nullable=True),
        sa.Column("gain_std", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["analysis_id"], ["analysis.id"], name=op.f("fk_sensor_result_analysis_id_analysis")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_sensor_result")),
        sa.UniqueConstraint("analysis_id", "channel", name=op.f("uq_sensor_result_analysis_id_channel")),
    )
    op.create_index(op.f("ix_sensor_result_analysis_id"), "sensor_result", ["analysis_id"])


def downgrade() -> None:
    """They go."""
    op.drop_table("sensor_result")
    with op.batch_alter_table("analysis") as table:
        table.drop_column("temperature")
