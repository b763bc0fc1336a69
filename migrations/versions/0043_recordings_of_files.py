"""An index of the recordings of each file, by which pruning finds them; it read all recordings once for each file."""

from alembic import op

revision = "0043_recordings_of_files"
down_revision = "0042_recorded_stations"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the index."""
    op.create_index(op.f("ix_recording_sha256"), "recording", ["sha256"])


def downgrade() -> None:
    """Remove it."""
    op.drop_index(op.f("ix_recording_sha256"), table_name="recording")
