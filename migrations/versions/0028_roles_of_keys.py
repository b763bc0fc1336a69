"""Keys with a higher role on single buildings."""

import sqlalchemy as sa
from alembic import op

revision = "0028_roles_of_keys"
down_revision = "0027_report_by_mail"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    with op.batch_alter_table("api_key") as table:
        table.add_column(sa.Column("higher", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    """Remove it: keys keep their lower role, which they have on every building."""
    with op.batch_alter_table("api_key") as table:
        table.drop_column("higher")
