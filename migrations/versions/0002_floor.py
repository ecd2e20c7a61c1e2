"""A reach holds the least that it can cost in an answer and how far its pivots spread, in place of its balance; and by
how much its crank and its coupler turn, NULL in rows that were there before."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

# What `catalogue.build.floor` computes for new rows.
AMPLE = " ".join(f"WHEN {level} THEN {0.3 * 10.0 ** (level + 1):.17g}" for level in range(-12, 0))
LINE = f"""
min(
    size - min_transmission / 90,
    coalesce(
        (
            SELECT CASE
                WHEN looser.deviation < CASE reach.level {AMPLE} END
                THEN min(looser.size - reach.min_transmission / 90, max(1.0, reach.size / 3) - 2 / 90.0)
                ELSE looser.size - reach.min_transmission / 90
            END
            FROM old_reach AS looser WHERE looser.guide_id = reach.guide_id AND looser.level = reach.level + 1
        ),
        max(1.0, size / {10.0 ** (1 / 3):.17g}) - min_transmission / 90
    )
)
"""
CIRCLE = """
size - max(
    min_transmission,
    coalesce(
        (
            SELECT tighter.min_transmission FROM old_reach AS tighter
            WHERE tighter.guide_id = reach.guide_id AND tighter.level < reach.level
            AND tighter.stroke < reach.stroke * (1 - 1e-9)
            ORDER BY tighter.level DESC LIMIT 1
        ),
        min_transmission
    )
) / 90
"""
HEIGHT = "(CASE WHEN guide.curvature > 0 THEN -1 ELSE 1 END * 0.5 * sweep * (0.25 + 0.015625 * sweep * sweep))"
SPREAD = f"""
max(
    all_x1 - all_x0, all_y1 - all_y0, 0.5 - all_x0, all_x1 - 0.5, {HEIGHT} - all_y0, all_y1 - {HEIGHT}
)
"""


NEW = ("floor", "spread", "drive_angle", "rotation")


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
        real("spread"),
        integer("rotates"),
        *(real(f"fixed_{side}", nullable=True) for side in ("x0", "y0", "x1", "y1")),
        *(real(f"all_{side}") for side in ("x0", "y0", "x1", "y1")),
        real("drive_angle", nullable=True),
        real("rotation", nullable=True),
    ]


def upgrade() -> None:
    op.drop_index("ix_reach_balance", if_exists=True)  # a build that was interrupted has none
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
        rule("ck_reach_spread", "spread >= 0"),
        rule("ck_reach_rotates", "rotates BETWEEN 0 AND 3"),
        rule(
            "ck_reach_fixed_box",
            "coalesce(fixed_x0 <= fixed_x1 AND fixed_y0 <= fixed_y1,"
            " fixed_x0 IS NULL AND fixed_y0 IS NULL AND fixed_x1 IS NULL AND fixed_y1 IS NULL)",
        ),
        rule("ck_reach_all_box", "all_x0 <= all_x1 AND all_y0 <= all_y1"),
        sqlite_strict=True,
    )
    kept = [column.name for column in columns() if column.name not in NEW]
    op.execute(
        f"INSERT INTO reach ({', '.join(kept)}, floor, spread) SELECT {', '.join(f'reach.{name}' for name in kept)}, "
        f"CASE WHEN sweep = 0 THEN {LINE} ELSE {CIRCLE} END, {SPREAD} "
        "FROM old_reach AS reach JOIN guide ON guide.id = reach.guide_id"
    )
    op.drop_table("old_reach")
    op.create_index("ix_reach_size", "reach", ["kind", "series", "level", "size"])
    op.create_index(
        "ix_reach_floor", "reach", ["kind", "series", "level", "floor", "guide_id", "sweep", "size", "spread"]
    )
    op.execute("ANALYZE")
