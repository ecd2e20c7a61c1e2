"""A guide may touch its nominal with contact of first order, as a path does that crosses it at all its inflections."""

from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # a rule of a table is its text: to make it weaker needs no copy of the rows
    op.execute("PRAGMA writable_schema = ON")
    op.execute(
        "UPDATE sqlite_master SET sql = replace(sql, 'contact_order >= 2', 'contact_order >= 1')"
        " WHERE type = 'table' AND name = 'guide'"
    )
    op.execute("PRAGMA writable_schema = RESET")
