"""A table for the specimens of collections."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def text(name: str) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=False)


def rule(name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(name))


def upgrade() -> None:
    op.create_table(
        "specimens",
        sa.Column("id", sa.INTEGER, nullable=False),
        text("collection"),
        text("family"),
        text("series"),
        text("configuration"),
        text("kind"),
        sa.Column("block", sa.INTEGER, nullable=False),
        sa.Column("deviation", sa.REAL, nullable=False),
        text("parameters"),
        text("metrics"),
        sa.PrimaryKeyConstraint("id", name="pk_specimens"),
        rule("ck_specimens_kind", "kind IN ('line', 'circle')"),
        rule("ck_specimens_block", "block >= 0"),
        rule("ck_specimens_deviation", "deviation >= 0"),
        rule("ck_specimens_parameters", "json_valid(parameters) AND json_type(parameters) = 'object'"),
        rule("ck_specimens_metrics", "json_valid(metrics) AND json_type(metrics) = 'object'"),
        sqlite_strict=True,
    )
    op.create_index("ix_specimens_deviation", "specimens", ["collection", "kind", "deviation"])
