"""Models of the isolation layer, what they were held against, and jobs that work on them."""

import sqlalchemy as sa
from alembic import op

revision = "0005_models"
down_revision = "0004_reliance"
branch_labels = None
depends_on = None

CURRENT = sa.text("state = 'current'")
JOB = ("asked_by", "refusal", "progress", "result")


def upgrade() -> None:
    """The jobs that are there work on events, as before."""
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
        sqlite_where=CURRENT,
        postgresql_where=CURRENT,
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
    for name in ("analysis_id", "event_id"):
        op.create_index(op.f(f"ix_model_comparison_{name}"), "model_comparison", [name])
    with op.batch_alter_table("job") as table:
        table.alter_column("event_id", existing_type=sa.Integer(), nullable=True)
        table.add_column(sa.Column("model_id", sa.Integer(), nullable=True))
        table.add_column(sa.Column("asked_by", sa.String(), nullable=True))
        table.add_column(sa.Column("refusal", sa.Text(), nullable=True))
        table.add_column(sa.Column("progress", sa.JSON(none_as_null=True), nullable=True))
        table.add_column(sa.Column("result", sa.JSON(none_as_null=True), nullable=True))
        table.create_index(op.f("ix_job_model_id"), ["model_id"])
        table.create_foreign_key(op.f("fk_job_model_id_model_version"), "model_version", ["model_id"], ["id"])


def downgrade() -> None:
    """Jobs that work on models go with these."""
    op.execute("DELETE FROM job WHERE event_id IS NULL")
    with op.batch_alter_table("job") as table:
        table.drop_constraint(op.f("fk_job_model_id_model_version"), type_="foreignkey")
        table.drop_index(op.f("ix_job_model_id"))
        table.alter_column("event_id", existing_type=sa.Integer(), nullable=False)
        for name in ("model_id", *JOB):
            table.drop_column(name)
    op.drop_table("model_comparison")
    op.drop_table("model_version")
