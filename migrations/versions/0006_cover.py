"""A guide holds its place in the coverage order of its member; what only a dense catalogue needed goes."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

#: The order of the guides of a member and kind in older files: that in which they were drawn, named guides first.
COVER = """
CASE WHEN mechanism.batch_id IS NULL THEN 0 ELSE row_number() OVER (
    PARTITION BY mechanism.batch_id IS NULL, mechanism.series, mechanism.member, guide.kind ORDER BY guide.id
) - 1 END
"""


def integer(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.INTEGER, nullable=nullable)


def real(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.REAL, nullable=nullable)


def text(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=nullable)


def rule(name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(name))


def batch() -> list[sa.Column]:
    names = ("series", "member", "plugin", "plugin_version", "plan")
    counts = ("seed", "number", "drawn", "kept", "guides", "wanted")
    return [integer("id"), *(text(name) for name in names), *(integer(name) for name in counts)]


def guide() -> list[sa.Column]:
    return [
        integer("id"),
        integer("mechanism_id"),
        *(text(name) for name in ("series", "kind", "label")),
        *(real(name) for name in ("x", "y", "tangent_x", "tangent_y", "curvature")),
        integer("contact_order"),
        integer("inflections"),
        real("leading", nullable=True),
        integer("cover"),
    ]


def reach() -> list[sa.Column]:
    return [
        integer("guide_id"),
        integer("level"),
        text("kind"),
        text("series"),
        integer("cover"),
        *(real(name) for name in ("stroke", "half", "centre", "deviation", "sweep", "size")),
        *(real(name, nullable=True) for name in ("max_link", "min_link", "max_ground")),
        real("max_arm"),
        real("min_transmission"),
        integer("rotates"),
        *(real(f"fixed_{side}", nullable=True) for side in ("x0", "y0", "x1", "y1")),
        *(real(f"all_{side}") for side in ("x0", "y0", "x1", "y1")),
        real("drive_angle", nullable=True),
        real("rotation", nullable=True),
    ]


def make_batch() -> None:
    op.create_table(
        "batch",
        *batch(),
        sa.PrimaryKeyConstraint("id", name="pk_batch"),
        sa.UniqueConstraint(
            "series", "member", "seed", "number", "plan", name="uq_batch_series_member_seed_number_plan"
        ),
        rule("ck_batch_number", "number >= 0"),
        rule("ck_batch_counts", "drawn >= 0 AND kept >= 0 AND guides >= 0 AND wanted >= guides"),
        sqlite_strict=True,
    )


def make_guide() -> None:
    op.create_table(
        "guide",
        *guide(),
        sa.PrimaryKeyConstraint("id", name="pk_guide"),
        sa.ForeignKeyConstraint(
            ["mechanism_id", "series"],
            ["mechanism.id", "mechanism.series"],
            name="fk_guide_mechanism",
            ondelete="CASCADE",
        ),
        sa.UniqueConstraint("id", "kind", "series", "cover", name="uq_guide_id_kind_series_cover"),
        rule("ck_guide_kind", "kind IN ('line', 'circle', 'slot', 'arc', 'return-line', 'return-circle')"),
        rule("ck_guide_tangent", "abs(tangent_x * tangent_x + tangent_y * tangent_y - 1) < 2e-9"),
        rule("ck_guide_curvature", "(kind IN ('line', 'slot', 'return-line')) = (curvature = 0)"),
        rule("ck_guide_contact_order", "contact_order >= 2"),
        rule("ck_guide_inflections", "inflections >= 0"),
        rule("ck_guide_cover", "cover >= 0"),
        sqlite_strict=True,
    )


def make_reach() -> None:
    op.create_table(
        "reach",
        *reach(),
        sa.PrimaryKeyConstraint("guide_id", "level", name="pk_reach"),
        sa.ForeignKeyConstraint(
            ["guide_id", "kind", "series", "cover"],
            ["guide.id", "guide.kind", "guide.series", "guide.cover"],
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
        rule("ck_reach_rotates", "rotates BETWEEN 0 AND 3"),
        rule(
            "ck_reach_fixed_box",
            "coalesce(fixed_x0 <= fixed_x1 AND fixed_y0 <= fixed_y1,"
            " fixed_x0 IS NULL AND fixed_y0 IS NULL AND fixed_x1 IS NULL AND fixed_y1 IS NULL)",
        ),
        rule("ck_reach_all_box", "all_x0 <= all_x1 AND all_y0 <= all_y1"),
        sqlite_strict=True,
    )


def copy(table: str, columns: list[sa.Column], made: dict[str, str], joined: str = "") -> None:
    """Fill a table from the older one; a column of the same name is taken over unless it is made otherwise."""
    names = [column.name for column in columns]
    values = (made.get(name, f"{table}.{name}") for name in names)
    op.execute(
        f"INSERT INTO {table} ({', '.join(names)}) SELECT {', '.join(values)} FROM old_{table} AS {table}{joined}"
    )


def upgrade() -> None:
    for index in ("ix_reach_promise", "ix_reach_size", "ix_guide_mechanism"):
        op.drop_index(index, table_name=index.split("_")[1], if_exists=True)  # an interrupted build has none
    op.execute("PRAGMA legacy_alter_table = ON")  # what refers to a table goes on to mean the one of that name
    for table in ("batch", "guide", "reach"):
        op.rename_table(table, f"old_{table}")
    op.execute("PRAGMA legacy_alter_table = OFF")
    make_batch()
    copy("batch", batch(), {"wanted": "batch.guides"})
    make_guide()
    copy("guide", guide(), {"cover": COVER}, " JOIN mechanism ON mechanism.id = guide.mechanism_id")
    make_reach()
    copy("reach", reach(), {"cover": "guide.cover"}, " JOIN guide ON guide.id = reach.guide_id")
    for table in ("reach", "guide", "batch"):
        op.drop_table(f"old_{table}")
    op.create_index("ix_guide_mechanism", "guide", ["mechanism_id"])
    op.create_index("ix_reach_cover", "reach", ["kind", "level", "cover"])
    op.execute("ANALYZE")
