"""Run migrations on the connection and within the transaction that the caller hands over.

The caller also sees to the foreign keys, off before and checked after; see `catalogue/store/engine.py`.
There are no downgrades: the way back is the copy made before an upgrade.
"""

from alembic import context

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=context.config.attributes["metadata"],
    render_as_batch=True,  # SQLite can alter little in place
    transactional_ddl=True,  # a migration that fails leaves nothing behind
)

with context.begin_transaction():
    context.run_migrations()
