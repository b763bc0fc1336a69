"""Parsed descriptions beside their files, and indexes for the periodic checks and the metrics."""

import sqlalchemy as sa
from alembic import op

revision = "0021_parsed_descriptions"
down_revision = "0020_tables"
branch_labels = None
depends_on = None

PARTIAL = (("ix_recording_read", "end", "read"), ("ix_recording_refused", "received_at", "refused"))
"""Indexes of the recordings of a building in one state: name, second column, state."""


def upgrade() -> None:
    """Add a column of descriptions, which earlier revisions leave empty, and the indexes."""
    op.add_column("revision", sa.Column("parsed", sa.Text(), nullable=True))
    for name, column, state in PARTIAL:
        where = sa.text(f"state = '{state}'")
        op.create_index(name, "recording", ["building_id", column], sqlite_where=where, postgresql_where=where)
    where = sa.text("refusal IS NOT NULL")
    op.create_index("ix_analysis_refused", "analysis", ["event_id"], sqlite_where=where, postgresql_where=where)
    op.create_index(op.f("ix_event_building_id_updated_at"), "event", ["building_id", "updated_at"])
    op.create_index(op.f("ix_event_state_updated_at"), "event", ["state", "updated_at"])
    op.drop_index("ix_event_gathering", "event")


def downgrade() -> None:
    """Remove them."""
    where = sa.text("state = 'gathering'")
    op.create_index("ix_event_gathering", "event", ["updated_at"], sqlite_where=where, postgresql_where=where)
    op.drop_index(op.f("ix_event_state_updated_at"), "event")
    op.drop_index(op.f("ix_event_building_id_updated_at"), "event")
    op.drop_index("ix_analysis_refused", "analysis")
    for name, _, _ in PARTIAL:
        op.drop_index(name, "recording")
    op.drop_column("revision", "parsed")
