"""The layer's motion with its error, its torsion and its vertical load."""

import sqlalchemy as sa
from alembic import op

revision = "0002_layer_motion"
down_revision = "0001"
branch_labels = None
depends_on = None

NUMBERS = (
    "peak_displacement_std",
    "lowest_frequency",
    "highest_frequency",
    "residual_displacement",
    "residual_displacement_std",
)
HISTORIES = ("displacement_std_history", "velocity_std_history")


def upgrade() -> None:
    """New columns are empty in the results that are there."""
    with op.batch_alter_table("direction_result") as table:
        for name in NUMBERS:
            table.add_column(sa.Column(name, sa.Double(), nullable=True))
        for name in HISTORIES:
            table.add_column(sa.Column(name, sa.LargeBinary(), nullable=True))
    op.create_table(
        "layer_result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("analysis_id", sa.Integer(), nullable=False),
        sa.Column("start", sa.DateTime(timezone=True), nullable=False),
        sa.Column("rate", sa.Double(), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("peak_resultant", sa.Double(), nullable=True),
        sa.Column("peak_torsion", sa.Double(), nullable=True),
        sa.Column("peak_torsion_std", sa.Double(), nullable=True),
        sa.Column("torsion_lowest_frequency", sa.Double(), nullable=True),
        sa.Column("axial_load_level", sa.String(), nullable=True),
        sa.Column("lowest_axial_load", sa.Double(), nullable=True),
        sa.Column("highest_axial_load", sa.Double(), nullable=True),
        sa.Column("torsion", sa.LargeBinary(), nullable=True),
        sa.Column("torsion_std_history", sa.LargeBinary(), nullable=True),
        sa.Column("axial_load", sa.LargeBinary(), nullable=True),
        sa.ForeignKeyConstraint(["analysis_id"], ["analysis.id"], name=op.f("fk_layer_result_analysis_id_analysis")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_layer_result")),
        sa.UniqueConstraint("analysis_id", name=op.f("uq_layer_result_analysis_id")),
    )


def downgrade() -> None:
    """The rest of each result stays."""
    op.drop_table("layer_result")
    with op.batch_alter_table("direction_result") as table:
        for name in (*HISTORIES, *NUMBERS):
            table.drop_column(name)
