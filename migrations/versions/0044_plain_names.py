"""Columns and roles under the names that engineers use: an estimate's assessment, and events held out of a fit."""

from alembic import op

revision = "0044_plain_names"
down_revision = "0043_recordings_of_files"
branch_labels = None
depends_on = None

COLUMNS = (("direction_result", "reliance", "assessment"), ("model_diagnosis", "left_out", "held_out"))
"""Table, former and new name."""


def upgrade() -> None:
    """Rename them."""
    for table, former, new in COLUMNS:
        op.execute(f"ALTER TABLE {table} RENAME COLUMN {former} TO {new}")
    op.execute("UPDATE model_comparison SET role = 'held_out' WHERE role = 'left_out'")


def downgrade() -> None:
    """Give them their former names."""
    for table, former, new in COLUMNS:
        op.execute(f"ALTER TABLE {table} RENAME COLUMN {new} TO {former}")
    op.execute("UPDATE model_comparison SET role = 'left_out' WHERE role = 'held_out'")
