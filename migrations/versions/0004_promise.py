"""A reach holds what it costs between it and its neighbour, and its index all that this is computed from."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

DECADE = 10.0 ** (1 / 3)
#: Half-way between two levels, where it was not measured, so much of the way from one balance to the other is gone.
HALFWAY = 0.6

# What `catalogue.build.promise` computes for new rows, but for what is measured half-way and over half a window.
OWN = "(reach.size - reach.min_transmission / 90)"
FARTHER = f"""
coalesce(
    next.size - next.min_transmission / 90,
    min({OWN}, max(1.0, reach.size / {DECADE:.17g}) - reach.min_transmission / 90)
)
"""
LINE = {
    "halfway": f"{1 - HALFWAY:.17g} * {OWN} + {HALFWAY:.17g} * {FARTHER}",
    "farther": FARTHER,
    "floor": f"min({OWN}, {FARTHER})",
}
INNER_SWEEP = "coalesce(min(next.sweep, reach.sweep), 0.0)"
ARC = {
    "inner_sweep": INNER_SWEEP,
    "inner_size": f"coalesce(next.size * {INNER_SWEEP} / reach.sweep, max(0.5, reach.spread))",
    "inner_transmission": "coalesce(next.min_transmission, reach.min_transmission)",
    "floor": f"""
CASE WHEN {INNER_SWEEP} < reach.sweep THEN min(
    {OWN},
    min(reach.size, coalesce(next.size, reach.size))
    - max(reach.min_transmission, coalesce(next.min_transmission, reach.min_transmission)) / 90
) ELSE {OWN} END
""",
}
NEW = ("halfway", "farther", "inner_sweep", "inner_size", "inner_transmission")


def integer(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.INTEGER, nullable=nullable)


def real(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.REAL, nullable=nullable)


def text(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=nullable)


def rule(name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(name))


def columns() -> list[sa.Column]:
    return [
        integer("guide_id"),
        integer("level"),
        text("kind"),
        text("series"),
        real("stroke"),
        real("half"),
        real("centre"),
        real("deviation"),
        real("sweep"),
        real("size"),
        real("max_link", nullable=True),
        real("min_link", nullable=True),
        real("max_ground", nullable=True),
        real("max_arm"),
        real("min_transmission"),
        real("floor"),
        *(real(name, nullable=True) for name in NEW),
        integer("rotates"),
        *(real(f"fixed_{side}", nullable=True) for side in ("x0", "y0", "x1", "y1")),
        *(real(f"all_{side}") for side in ("x0", "y0", "x1", "y1")),
        real("drive_angle", nullable=True),
        real("rotation", nullable=True),
    ]


def upgrade() -> None:
    op.drop_index("ix_reach_floor", if_exists=True)  # a build that was interrupted has none
    op.drop_index("ix_reach_size", if_exists=True)
    op.rename_table("reach", "old_reach")
    op.create_table(
        "reach",
        *columns(),
        sa.PrimaryKeyConstraint("guide_id", "level", name="pk_reach"),
        sa.ForeignKeyConstraint(
            ["guide_id", "kind", "series"],
            ["guide.id", "guide.kind", "guide.series"],
            name="fk_reach_guide",
            ondelete="CASCADE",
        ),
        rule("ck_reach_level", "level BETWEEN -12 AND -1"),
        rule("ck_reach_stroke", "stroke > 0"),
        rule("ck_reach_window", "half > 0 AND abs(centre) < 1"),
        rule("ck_reach_deviation", "deviation >= 0"),
        rule("ck_reach_sweep", "sweep >= 0 AND (kind IN ('line', 'slot', 'return-line')) = (sweep = 0)"),
        rule("ck_reach_size", "size > 0"),
        rule("ck_reach_max_link", "max_link > 0"),
        rule("ck_reach_min_link", "min_link > 0"),
        rule("ck_reach_max_ground", "max_ground >= 0"),
        rule("ck_reach_max_arm", "max_arm >= 0"),
        rule("ck_reach_min_transmission", "min_transmission BETWEEN 0 AND 90"),
        rule("ck_reach_floor", "floor <= size - min_transmission / 90 + 1e-9 * size"),
        rule(
            "ck_reach_promise",
            "CASE WHEN sweep = 0 THEN halfway IS NOT NULL AND farther IS NOT NULL ELSE coalesce("
            "inner_sweep BETWEEN 0 AND sweep AND inner_size >= 0 AND inner_transmission BETWEEN 0 AND 90, FALSE) END",
        ),
        rule("ck_reach_rotates", "rotates BETWEEN 0 AND 3"),
        rule(
            "ck_reach_fixed_box",
            "coalesce(fixed_x0 <= fixed_x1 AND fixed_y0 <= fixed_y1,"
            " fixed_x0 IS NULL AND fixed_y0 IS NULL AND fixed_x1 IS NULL AND fixed_y1 IS NULL)",
        ),
        rule("ck_reach_all_box", "all_x0 <= all_x1 AND all_y0 <= all_y1"),
        sqlite_strict=True,
    )
    kept = [column.name for column in columns() if column.name not in (*NEW, "floor")]
    for made, which, step in ((LINE, "=", "+"), (ARC, ">", "-")):
        op.execute(
            f"INSERT INTO reach ({', '.join([*kept, *made])}) "
            f"SELECT {', '.join([*(f'reach.{name}' for name in kept), *made.values()])} "
            "FROM old_reach AS reach LEFT JOIN old_reach AS next "
            f"ON next.guide_id = reach.guide_id AND next.level = reach.level {step} 1 WHERE reach.sweep {which} 0"
        )
    op.drop_table("old_reach")
    op.create_index("ix_reach_size", "reach", ["kind", "series", "level", "size"])
    op.create_index(
        "ix_reach_promise",
        "reach",
        ["kind", "series", "level", "floor", "guide_id", "deviation", "sweep", "size", "min_transmission", *NEW],
    )
    op.execute("ANALYZE")
