"""All tables, as the steps of development up to revision 0019 left them."""

import sqlalchemy as sa
from alembic import op

revision = "0020_tables"
down_revision = None
branch_labels = None
depends_on = None

TABLES = (
    "api_key",
    "audit_entry",
    "building",
    "content",
    "lease",
    "login_link",
    "event",
    "fetched_file",
    "login_session",
    "receiver",
    "recording",
    "reference_period",
    "revision",
    "silence",
    "source_state",
    "alert",
    "event_recording",
    "message",
    "model_version",
    "waveform",
    "alert_change",
    "delivery",
    "inspection",
    "job",
    "analysis",
    "delivery_attempt",
    "model_diagnosis",
    "watched_series",
    "diagnosis_picture",
    "direction_result",
    "drift_alarm",
    "drift_value",
    "layer_result",
    "model_comparison",
    "sensor_result",
    "cycle_result",
    "mode_result",
)
"""In the order in which they refer to each other."""


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
        "audit_entry",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("address", sa.String(), nullable=False),
        sa.Column("action", sa.String(), nullable=False),
        sa.Column("target", sa.String(), nullable=False),
        sa.Column("details", sa.JSON(none_as_null=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_audit_entry")),
    )
    op.create_index(op.f("ix_audit_entry_at"), "audit_entry", ["at"])

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
        "login_link",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("hash", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("used_at", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_login_link")),
        sa.UniqueConstraint("hash", name=op.f("uq_login_link_hash")),
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
    op.create_index(
        "ix_event_gathering",
        "event",
        ["updated_at"],
        sqlite_where=sa.text("state = 'gathering'"),
        postgresql_where=sa.text("state = 'gathering'"),
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
        "login_session",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("hash", sa.String(), nullable=False),
        sa.Column("key_id", sa.Integer(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("used_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(
            ["key_id"], ["api_key.id"], name=op.f("fk_login_session_key_id_api_key"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_login_session")),
        sa.UniqueConstraint("hash", name=op.f("uq_login_session_hash")),
    )
    op.create_index(op.f("ix_login_session_key_id"), "login_session", ["key_id"])

    op.create_table(
        "receiver",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("address", sa.Text(), nullable=False),
        sa.Column("secret", sa.Text(), nullable=True),
        sa.Column("kinds", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("severities", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("origin", sa.String(), nullable=False),
        sa.Column("created_by", sa.String(), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("removed_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("since", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_receiver_building_id_building")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_receiver")),
        sa.UniqueConstraint("building_id", "name", name=op.f("uq_receiver_building_id_name")),
    )

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

    op.create_table(
        "reference_period",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("quantity", sa.String(), nullable=True),
        sa.Column("subject", sa.String(), nullable=True),
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
        "silence",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("pattern", sa.String(), nullable=False),
        sa.Column("starts_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ends_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended_by", sa.String(), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_silence_building_id_building")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_silence")),
    )
    op.create_index(op.f("ix_silence_building_id"), "silence", ["building_id"])

    op.create_table(
        "source_state",
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("cursor", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("attempted_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("looked_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("succeeded_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("failing_since", sa.DateTime(timezone=True), nullable=True),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("clock_ahead", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_source_state_building_id_building")),
        sa.PrimaryKeyConstraint("building_id", name=op.f("pk_source_state")),
    )

    op.create_table(
        "alert",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("cause", sa.String(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("began_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("changed_after", sa.DateTime(timezone=True), nullable=True),
        sa.Column("changed_by", sa.DateTime(timezone=True), nullable=True),
        sa.Column("onset_event_id", sa.Integer(), nullable=True),
        sa.Column("raised_event_id", sa.Integer(), nullable=True),
        sa.Column("event_ids", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("channels", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("evidence", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("summary", sa.Text(), nullable=False),
        sa.Column("sentences", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("held_by", sa.String(), nullable=True),
        sa.Column("opened_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("updated_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("activated_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("acknowledged_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("acknowledged_by", sa.String(), nullable=True),
        sa.Column("acknowledgement", sa.Text(), nullable=True),
        sa.Column("closed_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_alert_building_id_building")),
        sa.ForeignKeyConstraint(["onset_event_id"], ["event.id"], name=op.f("fk_alert_onset_event_id_event")),
        sa.ForeignKeyConstraint(["raised_event_id"], ["event.id"], name=op.f("fk_alert_raised_event_id_event")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alert")),
    )
    op.create_index(op.f("ix_alert_building_id"), "alert", ["building_id"])
    op.create_index(op.f("ix_alert_raised_event_id"), "alert", ["raised_event_id"])
    op.create_index(
        "uq_alert_open",
        "alert",
        ["building_id", "cause"],
        unique=True,
        sqlite_where=sa.text("closed_at IS NULL"),
        postgresql_where=sa.text("closed_at IS NULL"),
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
        "message",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("identity", sa.String(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("key", sa.String(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("sequence", sa.String(), nullable=False),
        sa.Column("severity", sa.String(), nullable=False),
        sa.Column("is_over", sa.Boolean(), nullable=False),
        sa.Column("subject", sa.Text(), nullable=False),
        sa.Column("sentences", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("facts", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("link", sa.Text(), nullable=False),
        sa.Column("picture_event_id", sa.Integer(), nullable=True),
        sa.Column("picture_direction", sa.String(), nullable=True),
        sa.Column("data", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("digest", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("unsent", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_message_building_id_building")),
        sa.ForeignKeyConstraint(["picture_event_id"], ["event.id"], name=op.f("fk_message_picture_event_id_event")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_message")),
        sa.UniqueConstraint("building_id", "key", "number", name=op.f("uq_message_building_id_key_number")),
        sa.UniqueConstraint("identity", name=op.f("uq_message_identity")),
    )
    op.create_index(op.f("ix_message_building_id_id"), "message", ["building_id", "id"])

    op.create_table(
        "model_version",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("building_id", sa.Integer(), nullable=False),
        sa.Column("direction", sa.String(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("parent_id", sa.Integer(), nullable=True),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("change", sa.Text(), nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("accepted_by", sa.String(), nullable=True),
        sa.Column("accepted_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("revision_id", sa.Integer(), nullable=False),
        sa.Column("reference", sa.DateTime(timezone=True), nullable=True),
        sa.Column("effects", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("standard_deviations", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("assumed", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("outcome", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_model_version_building_id_building")),
        sa.ForeignKeyConstraint(
            ["parent_id"], ["model_version.id"], name=op.f("fk_model_version_parent_id_model_version")
        ),
        sa.ForeignKeyConstraint(["revision_id"], ["revision.id"], name=op.f("fk_model_version_revision_id_revision")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_model_version")),
        sa.UniqueConstraint(
            "building_id", "direction", "number", name=op.f("uq_model_version_building_id_direction_number")
        ),
    )
    op.create_index(
        "uq_model_version_current",
        "model_version",
        ["building_id", "direction"],
        unique=True,
        sqlite_where=sa.text("state = 'current'"),
        postgresql_where=sa.text("state = 'current'"),
    )

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

    op.create_table(
        "alert_change",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("alert_id", sa.Integer(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("by", sa.String(), nullable=True),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("summary", sa.Text(), nullable=False),
        sa.Column("evidence", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(["alert_id"], ["alert.id"], name=op.f("fk_alert_change_alert_id_alert")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alert_change")),
    )
    op.create_index(op.f("ix_alert_change_alert_id"), "alert_change", ["alert_id"])

    op.create_table(
        "delivery",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("message_id", sa.Integer(), nullable=False),
        sa.Column("receiver_id", sa.Integer(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("due_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("claims", sa.Integer(), nullable=False),
        sa.Column("claimed_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("kept_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["message_id"], ["message.id"], name=op.f("fk_delivery_message_id_message")),
        sa.ForeignKeyConstraint(["receiver_id"], ["receiver.id"], name=op.f("fk_delivery_receiver_id_receiver")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_delivery")),
        sa.UniqueConstraint("message_id", "receiver_id", name=op.f("uq_delivery_message_id_receiver_id")),
    )
    op.create_index(op.f("ix_delivery_receiver_id"), "delivery", ["receiver_id"])
    op.create_index(op.f("ix_delivery_state_due_at"), "delivery", ["state", "due_at"])

    op.create_table(
        "inspection",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("alert_id", sa.Integer(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("by", sa.String(), nullable=False),
        sa.Column("outcome", sa.String(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        sa.Column("reference_from", sa.DateTime(timezone=True), nullable=True),
        sa.Column("evidence", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(["alert_id"], ["alert.id"], name=op.f("fk_inspection_alert_id_alert")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_inspection")),
    )
    op.create_index(op.f("ix_inspection_alert_id"), "inspection", ["alert_id"])

    op.create_table(
        "job",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("event_id", sa.Integer(), nullable=True),
        sa.Column("model_id", sa.Integer(), nullable=True),
        sa.Column("building_id", sa.Integer(), nullable=True),
        sa.Column("asked_by", sa.String(), nullable=True),
        sa.Column("arguments", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("claims", sa.Integer(), nullable=False),
        sa.Column("failures", sa.Integer(), nullable=False),
        sa.Column("claimed_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("error", sa.Text(), nullable=True),
        sa.Column("refusal", sa.Text(), nullable=True),
        sa.Column("progress", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("result", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["building_id"], ["building.id"], name=op.f("fk_job_building_id_building")),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_job_event_id_event")),
        sa.ForeignKeyConstraint(["model_id"], ["model_version.id"], name=op.f("fk_job_model_id_model_version")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
    )
    op.create_index(op.f("ix_job_building_id"), "job", ["building_id"])
    op.create_index(op.f("ix_job_event_id"), "job", ["event_id"])
    op.create_index(op.f("ix_job_finished_at"), "job", ["finished_at"])
    op.create_index(op.f("ix_job_model_id"), "job", ["model_id"])
    op.create_index(op.f("ix_job_state_id"), "job", ["state", "id"])

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
        sa.Column("temperature", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_analysis_event_id_event")),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_analysis_job_id_job")),
        sa.ForeignKeyConstraint(["revision_id"], ["revision.id"], name=op.f("fk_analysis_revision_id_revision")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_analysis")),
        sa.UniqueConstraint("job_id", name=op.f("uq_analysis_job_id")),
    )
    op.create_index(op.f("ix_analysis_event_id"), "analysis", ["event_id"])
    op.create_index(
        "uq_analysis_current",
        "analysis",
        ["event_id"],
        unique=True,
        sqlite_where=sa.text("current = 1"),
        postgresql_where=sa.text("current"),
    )

    op.create_table(
        "delivery_attempt",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("delivery_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("is_repeat", sa.Boolean(), nullable=False),
        sa.Column("address", sa.Text(), nullable=False),
        sa.Column("begun_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("outcome", sa.String(), nullable=True),
        sa.Column("answer", sa.Text(), nullable=True),
        sa.Column("seconds", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["delivery_id"], ["delivery.id"], name=op.f("fk_delivery_attempt_delivery_id_delivery")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_delivery_attempt")),
        sa.UniqueConstraint("delivery_id", "number", name=op.f("uq_delivery_attempt_delivery_id_number")),
    )

    op.create_table(
        "model_diagnosis",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("model_id", sa.Integer(), nullable=False),
        sa.Column("job_id", sa.Integer(), nullable=False),
        sa.Column("revision_id", sa.Integer(), nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("fitted", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("left_out", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("analyses", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("outcome", sa.String(), nullable=False),
        sa.Column("sentences", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("document", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["job.id"], name=op.f("fk_model_diagnosis_job_id_job")),
        sa.ForeignKeyConstraint(
            ["model_id"], ["model_version.id"], name=op.f("fk_model_diagnosis_model_id_model_version")
        ),
        sa.ForeignKeyConstraint(["revision_id"], ["revision.id"], name=op.f("fk_model_diagnosis_revision_id_revision")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_model_diagnosis")),
        sa.UniqueConstraint("job_id", name=op.f("uq_model_diagnosis_job_id")),
    )
    op.create_index(op.f("ix_model_diagnosis_model_id"), "model_diagnosis", ["model_id"])

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
        "diagnosis_picture",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("diagnosis_id", sa.Integer(), nullable=False),
        sa.Column("title", sa.String(), nullable=False),
        sa.Column("caption", sa.Text(), nullable=False),
        sa.Column("svg", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["diagnosis_id"], ["model_diagnosis.id"], name=op.f("fk_diagnosis_picture_diagnosis_id_model_diagnosis")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_diagnosis_picture")),
    )
    op.create_index(op.f("ix_diagnosis_picture_diagnosis_id"), "diagnosis_picture", ["diagnosis_id"])

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
        sa.Column("reliance", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("peak_displacement", sa.Double(), nullable=True),
        sa.Column("peak_displacement_std", sa.Double(), nullable=True),
        sa.Column("lowest_frequency", sa.Double(), nullable=True),
        sa.Column("highest_frequency", sa.Double(), nullable=True),
        sa.Column("residual_displacement", sa.Double(), nullable=True),
        sa.Column("residual_displacement_std", sa.Double(), nullable=True),
        sa.Column("displacement", sa.LargeBinary(), nullable=True),
        sa.Column("velocity", sa.LargeBinary(), nullable=True),
        sa.Column("displacement_std_history", sa.LargeBinary(), nullable=True),
        sa.Column("velocity_std_history", sa.LargeBinary(), nullable=True),
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

    op.create_table(
        "drift_alarm",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("series_id", sa.Integer(), nullable=False),
        sa.Column("rule", sa.String(), nullable=False),
        sa.Column("is_sure", sa.Boolean(), nullable=False),
        sa.Column("onset_event_id", sa.Integer(), nullable=False),
        sa.Column("after_event_id", sa.Integer(), nullable=True),
        sa.Column("by_event_id", sa.Integer(), nullable=True),
        sa.Column("raised_event_id", sa.Integer(), nullable=False),
        sa.Column("event_ids", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("drift", sa.Double(), nullable=False),
        sa.Column("low", sa.Double(), nullable=False),
        sa.Column("high", sa.Double(), nullable=False),
        sa.Column("false_alarms", sa.Double(), nullable=False),
        sa.Column("causes", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("message", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["after_event_id"], ["event.id"], name=op.f("fk_drift_alarm_after_event_id_event")),
        sa.ForeignKeyConstraint(["by_event_id"], ["event.id"], name=op.f("fk_drift_alarm_by_event_id_event")),
        sa.ForeignKeyConstraint(["onset_event_id"], ["event.id"], name=op.f("fk_drift_alarm_onset_event_id_event")),
        sa.ForeignKeyConstraint(["raised_event_id"], ["event.id"], name=op.f("fk_drift_alarm_raised_event_id_event")),
        sa.ForeignKeyConstraint(
            ["series_id"], ["watched_series.id"], name=op.f("fk_drift_alarm_series_id_watched_series")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_drift_alarm")),
    )
    op.create_index(op.f("ix_drift_alarm_onset_event_id"), "drift_alarm", ["onset_event_id"])
    op.create_index(op.f("ix_drift_alarm_raised_event_id"), "drift_alarm", ["raised_event_id"])
    op.create_index(op.f("ix_drift_alarm_series_id"), "drift_alarm", ["series_id"])

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
        sa.Column("is_excluded", sa.Boolean(), nullable=False),
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

    op.create_table(
        "model_comparison",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("model_id", sa.Integer(), nullable=False),
        sa.Column("event_id", sa.Integer(), nullable=False),
        sa.Column("analysis_id", sa.Integer(), nullable=False),
        sa.Column("direction", sa.String(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("version", sa.String(), nullable=False),
        sa.Column("misfit", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("displacement", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("accelerations", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("force", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(
            ["analysis_id"], ["analysis.id"], name=op.f("fk_model_comparison_analysis_id_analysis")
        ),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_model_comparison_event_id_event")),
        sa.ForeignKeyConstraint(
            ["model_id"], ["model_version.id"], name=op.f("fk_model_comparison_model_id_model_version")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_model_comparison")),
        sa.UniqueConstraint(
            "model_id", "analysis_id", "direction", name=op.f("uq_model_comparison_model_id_analysis_id_direction")
        ),
    )
    op.create_index(op.f("ix_model_comparison_analysis_id"), "model_comparison", ["analysis_id"])
    op.create_index(op.f("ix_model_comparison_event_id"), "model_comparison", ["event_id"])

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
        sa.Column("shape_std", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("misfit", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["result_id"], ["direction_result.id"], name=op.f("fk_mode_result_result_id_direction_result")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_mode_result")),
    )
    op.create_index(op.f("ix_mode_result_result_id"), "mode_result", ["result_id"])


def downgrade() -> None:
    """Back to the empty database."""
    for table in reversed(TABLES):
        op.drop_table(table)
