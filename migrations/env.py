"""What Alembic runs its steps in: the connection, and thus the transaction, that service.migrate opened."""

from alembic import context

from service.database import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
