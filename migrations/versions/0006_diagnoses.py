"""What models lack, by events, and the pictures of that."""

import sqlalchemy as sa
from alembic import op

revision = "0006_diagnoses"
down_revision = "0005_models"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Two new tables."""
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


def downgrade() -> None:
    """They go."""
    op.drop_table("diagnosis_picture")
    op.drop_table("model_diagnosis")
