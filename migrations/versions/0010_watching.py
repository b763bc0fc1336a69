"""What is watched for drift, when buildings count as healthy, and jobs that work on a building."""

import sqlalchemy as sa
from alembic import op

revision = "0010_watching"
down_revision = "0009_sensors"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Four new tables; the jobs that are there work on events and models, as before."""
    op.create_table(
        "reference_period",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("quantity", sa.String(), nullable=True),
        sa.Column("start", sa.DateTime(timezone=True), nullable=True),
        sa.Column("end", sa.DateTime(timezone=True), nullable=True),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["building_id"], ["building.id"], name=op.f("fk_reference_period_building_id_building")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_reference_period")),
    )
    op.create_index(op.f("ix_reference_period_building_id"), "reference_period", ["building_id"])
    op.create_table(
        "watched_series",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("job_id", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("quantity", sa.String(), nullable=False),
        sa.Column("subject", sa.String(), nullable=False),
        sa.Column("reference_id", sa.Integer(), nullable=True),
        sa.Column("wanted", sa.Integer(), nullable=False),
        sa.Column("baseline", sa.JSON(none_as_null=True), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_watched_series_building_id_building")),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_watched_series_job_id_job")),
        sa.ForeignKeyConstraint(
            ["reference_id"], ["reference_period.id"], name=op.f("fk_watched_series_reference_id_reference_period")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_watched_series")),
        sa.UniqueConstraint(
            "building_id", "quantity", "subject", name=op.f("uq_watched_series_building_id_quantity_subject")
        ),
    )
    op.create_index(op.f("ix_watched_series_job_id"), "watched_series", ["job_id"])
    op.create_table(
        "drift_value",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("series_id", sa.Integer(), nullable=False),
        sa.Column("event_id", sa.Integer(), nullable=False),
        sa.Column("value", sa.Double(), nullable=False),
        sa.Column("std", sa.Double(), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("is_reference", sa.Boolean(), nullable=False),
        sa.Column("is_beyond", sa.Boolean(), nullable=False),
        sa.Column("is_inhibited", sa.Boolean(), nullable=False),
        sa.Column("causes", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_drift_value_event_id_event")),
        sa.ForeignKeyConstraint(
            ["series_id"], ["watched_series.id"], name=op.f("fk_drift_value_series_id_watched_series")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_drift_value")),
        sa.UniqueConstraint("series_id", "event_id", name=op.f("uq_drift_value_series_id_event_id")),
    )
    op.create_index(op.f("ix_drift_value_event_id"), "drift_value", ["event_id"])
    op.create_table(
        "drift_alarm",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("series_id", sa.Integer(), nullable=False),
        sa.Column("rule", sa.String(), nullable=False),
        sa.Column("is_firing", sa.Boolean(), nullable=False),
        sa.Column("onset_event_id", sa.Integer(), nullable=False),
        sa.Column("raised_event_id", sa.Integer(), nullable=False),
        sa.Column("event_ids", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("drift", sa.Double(), nullable=False),
        sa.Column("low", sa.Double(), nullable=False),
        sa.Column("high", sa.Double(), nullable=False),
        sa.Column("false_alarms", sa.Double(), nullable=False),
        sa.Column("causes", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("message", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["onset_event_id"], ["event.id"], name=op.f("fk_drift_alarm_onset_event_id_event")),
        sa.ForeignKeyConstraint(["raised_event_id"], ["event.id"], name=op.f("fk_drift_alarm_raised_event_id_event")),
        sa.ForeignKeyConstraint(
            ["series_id"], ["watched_series.id"], name=op.f("fk_drift_alarm_series_id_watched_series")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_drift_alarm")),
    )
    for name in ("series_id", "onset_event_id", "raised_event_id"):
        op.create_index(op.f(f"ix_drift_alarm_{name}"), "drift_alarm", [name])
    with op.batch_alter_table("job") as table:
        table.add_column(sa.Column("building_id", sa.Integer(), nullable=True))
        table.create_index(op.f("ix_job_building_id"), ["building_id"])
        table.create_foreign_key(op.f("fk_job_building_id_building"), "building", ["building_id"], ["id"])


def downgrade() -> None:
    """Jobs that work on buildings go with them."""
    for name in ("drift_alarm", "drift_value", "watched_series", "reference_period"):
        op.drop_table(name)
    op.execute("DELETE FROM job WHERE kind = 'watch'")
    with op.batch_alter_table("job") as table:
        table.drop_constraint(op.f("fk_job_building_id_building"), type_="foreignkey")
        table.drop_index(op.f("ix_job_building_id"))
        table.drop_column("building_id")
