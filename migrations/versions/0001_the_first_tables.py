"""The first tables."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """From the empty database."""
    op.create_table(
        "api_key",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("hash", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revoked_at", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_api_key")),
        sa.UniqueConstraint("hash", name=op.f("uq_api_key_hash")),
        sa.UniqueConstraint("name", name=op.f("uq_api_key_name")),
    )
    op.create_table(
        "building",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("code", sa.String(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_building")),
        sa.UniqueConstraint("code", name=op.f("uq_building_code")),
    )
    op.create_table(
        "content",
        sa.Column("sha256", sa.String(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("data", sa.LargeBinary(), nullable=False),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_content")),
    )
    op.create_table(
        "lease",
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("holder", sa.String(), nullable=False),
        sa.Column("until", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_lease")),
    )
    op.create_table(
        "event",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("start", sa.DateTime(timezone=True), nullable=False),
        sa.Column("end", sa.DateTime(timezone=True), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("updated_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_event_building_id_building")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_event")),
    )
    op.create_index(op.f("ix_event_building_id_start"), "event", ["building_id", "start"])

    op.create_table(
        "recording",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("sha256", sa.String(), nullable=True),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("origin", sa.String(), nullable=False),
        sa.Column("received_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("failures", sa.Integer(), nullable=False),
        sa.Column("version", sa.String(), nullable=True),
        sa.Column("start", sa.DateTime(timezone=True), nullable=True),
        sa.Column("end", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_recording_building_id_building")),
        sa.ForeignKeyConstraint(["sha256"], ["content.sha256"], name=op.f("fk_recording_sha256_content")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_recording")),
        sa.UniqueConstraint("building_id", "sha256", name=op.f("uq_recording_building_id_sha256")),
    )
    op.create_index(op.f("ix_recording_building_id"), "recording", ["building_id"])

    op.create_table(
        "revision",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("toml", sa.Text(), nullable=False),
        sa.Column("folder", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_revision_building_id_building")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_revision")),
        sa.UniqueConstraint("building_id", "number", name=op.f("uq_revision_building_id_number")),
    )
    op.create_table(
        "source_state",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("cursor", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("attempted_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("succeeded_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("failing_since", sa.DateTime(timezone=True), nullable=True),
        sa.Column("error", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_source_state_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", name=op.f("pk_source_state")),
    )
    op.create_table(
        "fetched_file",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("address", sa.String(), nullable=False),
        sa.Column("mark", sa.String(), nullable=True),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("version", sa.String(), nullable=True),
        sa.Column("beginning", sa.LargeBinary(), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_fetched_file_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", "address", name=op.f("pk_fetched_file")),
    )
    op.create_table(
        "event_recording",
        sa.Column("event_id", sa.Integer(), nullable=False),
        sa.Column("recording_id", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_event_recording_event_id_event")),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recording.id"], name=op.f("fk_event_recording_recording_id_recording")
        ),
        sa.PrimaryKeyConstraint("event_id", "recording_id", name=op.f("pk_event_recording")),
    )
    op.create_index(op.f("ix_event_recording_recording_id"), "event_recording", ["recording_id"])

    op.create_table(
        "job",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("event_id", sa.Integer(), nullable=False),
        sa.Column("arguments", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("claims", sa.Integer(), nullable=False),
        sa.Column("failures", sa.Integer(), nullable=False),
        sa.Column("claimed_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_job_event_id_event")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
    )
    op.create_index(op.f("ix_job_event_id"), "job", ["event_id"])
    op.create_index(op.f("ix_job_state_id"), "job", ["state", "id"])

    op.create_table(
        "waveform",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("event_id", sa.Integer(), nullable=False),
        sa.Column("channel", sa.String(), nullable=False),
        sa.Column("start", sa.DateTime(timezone=True), nullable=False),
        sa.Column("rate", sa.Double(), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("gain", sa.Double(), nullable=False),
        sa.Column("samples", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_waveform_event_id_event")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_waveform")),
        sa.UniqueConstraint("event_id", "channel", "start", name=op.f("uq_waveform_event_id_channel_start")),
    )
    op.create_index(op.f("ix_waveform_event_id"), "waveform", ["event_id"])

    op.create_table(
        "analysis",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("event_id", sa.Integer(), nullable=False),
        sa.Column("job_id", sa.Integer(), nullable=False),
        sa.Column("revision_id", sa.Integer(), nullable=False),
        sa.Column("current", sa.Boolean(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("settings", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("inputs", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("estimator", sa.String(), nullable=True),
        sa.Column("quality", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("refusal", sa.Text(), nullable=True),
        sa.Column("peaks", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("pga", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_analysis_event_id_event")),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_analysis_job_id_job")),
        sa.ForeignKeyConstraint(["revision_id"], ["revision.id"], name=op.f("fk_analysis_revision_id_revision")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_analysis")),
        sa.UniqueConstraint("job_id", name=op.f("uq_analysis_job_id")),
    )
    op.create_index(op.f("ix_analysis_event_id"), "analysis", ["event_id"])

    op.create_table(
        "direction_result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("analysis_id", sa.Integer(), nullable=False),
        sa.Column("direction", sa.String(), nullable=False),
        sa.Column("start", sa.DateTime(timezone=True), nullable=False),
        sa.Column("rate", sa.Double(), nullable=False),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("peak_force", sa.Double(), nullable=False),
        sa.Column("force_std", sa.Double(), nullable=False),
        sa.Column("peak_displacement", sa.Double(), nullable=True),
        sa.Column("displacement", sa.LargeBinary(), nullable=True),
        sa.Column("velocity", sa.LargeBinary(), nullable=True),
        sa.Column("force", sa.LargeBinary(), nullable=False),
        sa.Column("force_rigid", sa.LargeBinary(), nullable=False),
        sa.Column("force_modal", sa.LargeBinary(), nullable=False),
        sa.Column("force_std_history", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["analysis_id"], ["analysis.id"], name=op.f("fk_direction_result_analysis_id_analysis")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_direction_result")),
        sa.UniqueConstraint("analysis_id", "direction", name=op.f("uq_direction_result_analysis_id_direction")),
    )
    op.create_index(op.f("ix_direction_result_analysis_id"), "direction_result", ["analysis_id"])

    op.create_table(
        "cycle_result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("result_id", sa.Integer(), nullable=False),
        sa.Column("start", sa.Double(), nullable=False),
        sa.Column("end", sa.Double(), nullable=False),
        sa.Column("amplitude", sa.Double(), nullable=False),
        sa.Column("shear_strain", sa.Double(), nullable=True),
        sa.Column("k_eq", sa.Double(), nullable=False),
        sa.Column("k_eq_std", sa.Double(), nullable=False),
        sa.Column("c_eq", sa.Double(), nullable=False),
        sa.Column("c_eq_std", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(
            ["result_id"], ["direction_result.id"], name=op.f("fk_cycle_result_result_id_direction_result")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_cycle_result")),
    )
    op.create_index(op.f("ix_cycle_result_result_id"), "cycle_result", ["result_id"])

    op.create_table(
        "mode_result",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("result_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("frequency", sa.Double(), nullable=False),
        sa.Column("frequency_std", sa.Double(), nullable=True),
        sa.Column("damping_ratio", sa.Double(), nullable=False),
        sa.Column("damping_ratio_std", sa.Double(), nullable=True),
        sa.Column("shape", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(
            ["result_id"], ["direction_result.id"], name=op.f("fk_mode_result_result_id_direction_result")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_mode_result")),
    )
    op.create_index(op.f("ix_mode_result_result_id"), "mode_result", ["result_id"])


def downgrade() -> None:
    """Back to the empty database."""
    op.drop_table("mode_result")
    op.drop_table("cycle_result")
    op.drop_table("direction_result")
    op.drop_table("analysis")
    op.drop_table("waveform")
    op.drop_table("job")
    op.drop_table("event_recording")
    op.drop_table("fetched_file")
    op.drop_table("source_state")
    op.drop_table("revision")
    op.drop_table("recording")
    op.drop_table("event")
    op.drop_table("lease")
    op.drop_table("content")
    op.drop_table("building")
    op.drop_table("api_key")
