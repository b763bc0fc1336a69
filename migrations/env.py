"""Alembic's environment: its steps run in the connection, and thus the transaction, that service.db.migrate opened."""

from alembic import context

from service.db.base import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
