"""Of what a reference period is, where it is not of all that a quantity is watched at."""

import sqlalchemy as sa
from alembic import op

revision = "0012_reference_subject"
down_revision = "0011_server_clock"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """One more column; the periods there are hold for all."""
    with op.batch_alter_table("reference_period") as table:
        table.add_column(sa.Column("subject", sa.String(), nullable=True))


def downgrade() -> None:
    """It goes, and with it the periods that held for one thing: without it they would hold for all."""
    op.execute(
        "UPDATE watched_series SET reference_id = NULL WHERE reference_id IN "
        "(SELECT id FROM reference_period WHERE subject IS NOT NULL)"
    )
    op.execute("DELETE FROM reference_period WHERE subject IS NOT NULL")
    with op.batch_alter_table("reference_period") as table:
        table.drop_column("subject")
