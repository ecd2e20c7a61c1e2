"""The first tables: batch, mechanism, guide, reach, setting."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def integer(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.INTEGER, nullable=nullable)


def real(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.REAL, nullable=nullable)


def text(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=nullable)


def rule(name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(name))


def upgrade() -> None:
    op.create_table(
        "batch",
        integer("id"),
        text("series"),
        text("member"),
        text("plugin"),
        text("plugin_version"),
        text("plan"),
        integer("seed"),
        integer("number"),
        integer("drawn"),
        integer("kept"),
        integer("guides"),
        sa.PrimaryKeyConstraint("id", name="pk_batch"),
        sa.UniqueConstraint(
            "series", "member", "seed", "number", "plan", name="uq_batch_series_member_seed_number_plan"
        ),
        rule("ck_batch_number", "number >= 0"),
        rule("ck_batch_counts", "drawn >= 0 AND kept >= 0 AND guides >= 0"),
        sqlite_strict=True,
    )
    op.create_table(
        "mechanism",
        integer("id"),
        integer("batch_id", nullable=True),
        text("family"),
        text("configuration"),
        text("series"),
        text("member"),
        text("name", nullable=True),
        text("parameters"),
        sa.Column("pivots", sa.BLOB, nullable=False),
        real("rho0", nullable=True),
        real("kappa", nullable=True),
        real("kappa_star", nullable=True),
        real("s", nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_mechanism"),
        sa.UniqueConstraint("name", name="uq_mechanism_name"),
        sa.UniqueConstraint("id", "series", name="uq_mechanism_id_series"),
        rule("ck_mechanism_parameters", "json_valid(parameters) AND json_type(parameters) = 'object'"),
        rule("ck_mechanism_pivots", "length(pivots) > 0 AND length(pivots) % 8 = 0"),
        rule("ck_mechanism_rho0", "rho0 IS NULL OR rho0 > 0"),
        rule(
            "ck_mechanism_curvature_whole",
            "(kappa IS NULL) = (kappa_star IS NULL) AND (kappa_star IS NULL) = (s IS NULL)",
        ),
        rule(
            "ck_mechanism_curvature",
            "rho0 IS NULL OR abs(kappa_star - kappa - 1 / rho0) <= 1e-9 * (1 + abs(kappa) + abs(kappa_star))",
        ),
        sa.ForeignKeyConstraint(["batch_id"], ["batch.id"], name="fk_mechanism_batch", ondelete="CASCADE"),
        sqlite_strict=True,
    )
    op.create_index("ix_mechanism_kind", "mechanism", ["series", "family", "configuration"])
    op.create_index("ix_mechanism_batch", "mechanism", ["batch_id"])
    op.create_table(
        "guide",
        integer("id"),
        integer("mechanism_id"),
        text("series"),
        text("kind"),
        text("label"),
        real("x"),
        real("y"),
        real("tangent_x"),
        real("tangent_y"),
        real("curvature"),
        integer("contact_order"),
        integer("inflections"),
        real("leading", nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_guide"),
        sa.ForeignKeyConstraint(
            ["mechanism_id", "series"],
            ["mechanism.id", "mechanism.series"],
            name="fk_guide_mechanism",
            ondelete="CASCADE",
        ),
        sa.UniqueConstraint("id", "kind", "series", name="uq_guide_id_kind_series"),
        rule("ck_guide_kind", "kind IN ('line', 'circle', 'slot', 'arc', 'return-line', 'return-circle')"),
        rule("ck_guide_tangent", "abs(tangent_x * tangent_x + tangent_y * tangent_y - 1) < 2e-9"),
        rule("ck_guide_curvature", "(kind IN ('line', 'slot', 'return-line')) = (curvature = 0)"),
        rule("ck_guide_contact_order", "contact_order >= 2"),
        rule("ck_guide_inflections", "inflections >= 0"),
        sqlite_strict=True,
    )
    op.create_index("ix_guide_mechanism", "guide", ["mechanism_id"])
    op.create_table(
        "reach",
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
        real("balance"),
        integer("rotates"),
        *(real(f"fixed_{side}", nullable=True) for side in ("x0", "y0", "x1", "y1")),
        *(real(f"all_{side}") for side in ("x0", "y0", "x1", "y1")),
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
        rule("ck_reach_balance", "abs(balance - size + min_transmission / 90) <= 1e-9 * size"),
        rule("ck_reach_rotates", "rotates BETWEEN 0 AND 3"),
        rule(
            "ck_reach_fixed_box",
            "coalesce(fixed_x0 <= fixed_x1 AND fixed_y0 <= fixed_y1,"
            " fixed_x0 IS NULL AND fixed_y0 IS NULL AND fixed_x1 IS NULL AND fixed_y1 IS NULL)",
        ),
        rule("ck_reach_all_box", "all_x0 <= all_x1 AND all_y0 <= all_y1"),
        sqlite_strict=True,
    )
    op.create_index("ix_reach_size", "reach", ["kind", "series", "level", "size"])
    op.create_index("ix_reach_balance", "reach", ["kind", "series", "level", "balance"])
    op.create_table(
        "setting",
        text("key"),
        text("value"),
        sa.PrimaryKeyConstraint("key", name="pk_setting"),
        sqlite_strict=True,
    )
