"""The channels that each building has recorded, and an index of the files to be read.

Stations are found without a look at every waveform, and waiting files without a look at every file.
"""

import sqlalchemy as sa
from alembic import op

revision = "0033_recorded_channels"
down_revision = "0032_language_of_recipients"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table, fill it from the waveforms, and add the index."""
    op.create_table(
        "recorded_channel",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("channel", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["building_id"], ["building.id"], name=op.f("fk_recorded_channel_building_id_building")
        ),
        sa.PrimaryKeyConstraint("building_id", "channel", name=op.f("pk_recorded_channel")),
    )
    op.execute(
        "INSERT INTO recorded_channel (building_id, channel) SELECT DISTINCT event.building_id, waveform.channel "
        "FROM waveform JOIN event ON event.id = waveform.event_id"
    )
    stored = sa.text("state = 'stored'")
    op.create_index(
        "ix_recording_stored", "recording", ["building_id", "id"], sqlite_where=stored, postgresql_where=stored
    )


def downgrade() -> None:
    """Remove both."""
    op.drop_index("ix_recording_stored", "recording")
    op.drop_table("recorded_channel")
