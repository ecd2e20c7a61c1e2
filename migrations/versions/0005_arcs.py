"""A reach of an arc holds what it costs as a function of its sweep."""

import math

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

# What `catalogue.build.promise` computes for new rows, from the measures of the next tighter reach, or of this one over
# half its window, that were stored.  For a radius of 1: chord and size at both ends.
LAST = "reach.inner_sweep = 0"
HERE, SHORT = "reach.sweep", f"(CASE WHEN {LAST} THEN 0.5 * reach.sweep ELSE reach.inner_sweep END)"
WHOLE, PART = f"(reach.size * {HERE})", f"(reach.inner_size * {HERE})"
BENT = f"(0.5 * (0.5 * ({WHOLE} + {PART}) + max({PART}, 0.5 * ({HERE} + {SHORT}))))"
EXTENT = "extent(reach.sweep, guide.curvature, reach.all_x0, reach.all_y0, reach.all_x1, reach.all_y1)"
GROWS = f"""
CASE WHEN reach.size < 1.000001 AND {LAST} THEN max({PART} - {EXTENT} * {HERE}, 0.0) / {SHORT}
WHEN reach.size < 1.000001 THEN ({BENT} - {PART}) / (0.5 * ({HERE} - {SHORT}))
ELSE ({WHOLE} - {PART}) / ({HERE} - {SHORT}) END
"""
ANGLE = "reach.inner_transmission"
TURNS = f"((reach.min_transmission - {ANGLE}) / (arc({HERE}) - arc({SHORT})))"
SERVES = f"{SHORT} < {HERE}"
ARC = {
    "floor": f"CASE WHEN {SERVES} THEN reach.floor ELSE 9e999 END",
    "inner_sweep": "reach.inner_sweep",
    "still": f"CASE WHEN {SERVES} THEN {PART} - {SHORT} * ({GROWS}) ELSE {WHOLE} END",
    "grows": f"CASE WHEN {SERVES} THEN {GROWS} ELSE 0.0 END",
    "angle": f"CASE WHEN {SERVES} THEN {ANGLE} - arc({SHORT}) * {TURNS} ELSE reach.min_transmission END",
    "turns": f"CASE WHEN {SERVES} THEN {TURNS} ELSE 0.0 END",
}
LINE = {name: f"reach.{name}" for name in ("floor", "halfway", "farther")}
NEW = ("halfway", "farther", "inner_sweep", "still", "grows", "angle", "turns")


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


def arc(sweep: float) -> float:
    """Return the angle of an arc of so long a chord and a radius of 1; many builds of SQLite have no arcsin."""
    return 2 * math.asin(min(0.5 * sweep, 1.0))


def extent(sweep: float, curvature: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Return the extent of the box of the pivots, or its distance from the summit of the path, in strokes."""
    summit = -math.copysign(math.tan(0.25 * arc(sweep)) / 2, curvature)
    return max(x1 - x0, y1 - y0, 0.5 - x0, x1 - 0.5, summit - y0, y1 - summit)


def upgrade() -> None:
    if "still" in {column["name"] for column in sa.inspect(op.get_bind()).get_columns("reach")}:
        return  # for a day files of revision 0004 were written so
    driver = op.get_bind().connection.driver_connection
    driver.create_function("arc", 1, arc, deterministic=True)
    driver.create_function("extent", 6, extent, deterministic=True)
    op.drop_index("ix_reach_promise", if_exists=True)  # a build that was interrupted has none
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
        rule(
            "ck_reach_floor",
            "coalesce(inner_sweep = sweep, FALSE) OR floor <= size - min_transmission / 90 + 1e-9 * size",
        ),
        rule(
            "ck_reach_promise",
            "CASE WHEN sweep = 0 THEN halfway IS NOT NULL AND farther IS NOT NULL ELSE coalesce("
            "inner_sweep BETWEEN 0 AND sweep AND still + grows + angle + turns IS NOT NULL, FALSE) END",
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
    kept = [column.name for column in columns() if column.name not in (*ARC, "halfway", "farther")]
    for made, which in ((LINE, "="), (ARC, ">")):
        op.execute(
            f"INSERT INTO reach ({', '.join([*kept, *made])}) "
            f"SELECT {', '.join([*(f'reach.{name}' for name in kept), *made.values()])} "
            f"FROM old_reach AS reach JOIN guide ON guide.id = reach.guide_id WHERE reach.sweep {which} 0"
        )
    op.drop_table("old_reach")
    op.create_index("ix_reach_size", "reach", ["kind", "series", "level", "size"])
    promise = ["deviation", "size", "min_transmission", "halfway", "farther", "sweep", *NEW[2:]]
    op.create_index("ix_reach_promise", "reach", ["kind", "series", "level", "floor", "guide_id", *promise])
    op.execute("ANALYZE")
