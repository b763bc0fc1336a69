"""Stations and times of the channels that each building has recorded, and where the buildings are.

Stations are listed without a look at waveforms and descriptions.
"""

import sqlalchemy as sa
from alembic import op

revision = "0042_recorded_stations"
down_revision = "0041_drift_state"
branch_labels = None
depends_on = None

STATION = {
    "postgresql": "split_part(waveform.channel, '.', 1) || '.' || split_part(waveform.channel, '.', 2)",
    "sqlite": "substr(waveform.channel, 1, instr(waveform.channel, '.') "
    "+ instr(substr(waveform.channel, instr(waveform.channel, '.') + 1), '.') - 1)",
}
"""Network and station of a channel, in each database's words."""
OF_LEVEL = "SELECT {} FROM building_level WHERE building_level.building_id = building.id"


def upgrade() -> None:
    """Add the columns: places as of the last check of each building, times of channels from their waveforms."""
    with op.batch_alter_table("building") as table:
        table.add_column(sa.Column("latitude", sa.Double(), nullable=True))
        table.add_column(sa.Column("longitude", sa.Double(), nullable=True))
    places = ", ".join(f"{one} = ({OF_LEVEL.format(one)})" for one in ("latitude", "longitude"))
    op.execute(f"UPDATE building SET {places}")
    op.drop_table("recorded_channel")
    _create(
        sa.Column("station", sa.String(), nullable=False),
        sa.Column("start", sa.DateTime(timezone=True), nullable=False),
        sa.Column("end", sa.DateTime(timezone=True), nullable=False),
    )
    op.execute(
        'INSERT INTO recorded_channel (building_id, channel, station, start, "end") SELECT event.building_id, '
        f'waveform.channel, {STATION[op.get_bind().dialect.name]}, min(waveform.start), max(event."end") '
        "FROM waveform JOIN event ON event.id = waveform.event_id GROUP BY event.building_id, waveform.channel"
    )


def downgrade() -> None:
    """Remove them."""
    op.drop_table("recorded_channel")
    _create()
    op.execute(
        "INSERT INTO recorded_channel (building_id, channel) SELECT DISTINCT event.building_id, waveform.channel "
        "FROM waveform JOIN event ON event.id = waveform.event_id"
    )
    with op.batch_alter_table("building") as table:
        table.drop_column("longitude")
        table.drop_column("latitude")


def _create(*more: sa.Column[object]) -> None:
    op.create_table(
        "recorded_channel",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("channel", sa.String(), nullable=False),
        *more,
        sa.ForeignKeyConstraint(
            ["building_id"], ["building.id"], name=op.f("fk_recorded_channel_building_id_building")
        ),
        sa.PrimaryKeyConstraint("building_id", "channel", name=op.f("pk_recorded_channel")),
    )
