"""A specimen has its place in its block, so that none can be stored twice; what was stored twice goes."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

PLACE = ("collection", "family", "block", "place")
BLOCK = ", ".join(PLACE[:3])
#: Columns that were there before, but for the id.
BEFORE = f"{BLOCK}, series, configuration, kind, deviation, parameters, metrics"


def text(name: str) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=False)


def rule(name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(name))


def upgrade() -> None:
    op.drop_index("ix_specimens_deviation", table_name="specimens", if_exists=True)  # an interrupted build has none
    op.rename_table("specimens", "old_specimens")
    op.create_table(
        "specimens",
        sa.Column("id", sa.INTEGER, nullable=False),
        *(text(name) for name in ("collection", "family", "series", "configuration", "kind")),
        sa.Column("block", sa.INTEGER, nullable=False),
        sa.Column("place", sa.INTEGER, nullable=False),
        sa.Column("deviation", sa.REAL, nullable=False),
        text("parameters"),
        text("metrics"),
        sa.PrimaryKeyConstraint("id", name="pk_specimens"),
        sa.UniqueConstraint(*PLACE, name=f"uq_specimens_{'_'.join(PLACE)}"),
        rule("ck_specimens_kind", "kind IN ('line', 'circle')"),
        rule("ck_specimens_block", "block >= 0"),
        rule("ck_specimens_place", "place >= 0"),
        rule("ck_specimens_deviation", "deviation >= 0"),
        rule("ck_specimens_parameters", "json_valid(parameters) AND json_type(parameters) = 'object'"),
        rule("ck_specimens_metrics", "json_valid(metrics) AND json_type(metrics) = 'object'"),
        sqlite_strict=True,
    )
    op.execute(
        f"INSERT INTO specimens (id, {BEFORE}, place)"
        f" SELECT id, {BEFORE}, row_number() OVER (PARTITION BY {BLOCK} ORDER BY id) - 1"
        f" FROM (SELECT min(id) AS id, {BEFORE} FROM old_specimens GROUP BY {BEFORE}) ORDER BY id"
    )
    op.drop_table("old_specimens")
    op.create_index("ix_specimens_deviation", "specimens", ["collection", "kind", "deviation"])
