"""Pivots become columns, which any program can read; a table says what each column means.

SQLite keeps no sign of zero: -0.0 among the pivots becomes 0.0.
"""

import struct

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

PIVOTS = [f"{joint}_{dyad}_{part}" for dyad in (1, 2) for joint in ("fixed", "moving") for part in "xyw"]


def text(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=nullable)


def real(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.REAL, nullable=nullable)


def rule(name: str, condition: str) -> sa.CheckConstraint:
    return sa.CheckConstraint(condition, name=op.f(name))


def mechanism() -> list[sa.Column]:
    return [
        sa.Column("id", sa.INTEGER, nullable=False),
        sa.Column("batch_id", sa.INTEGER),
        *(text(name) for name in ("family", "configuration", "series", "member")),
        text("name", nullable=True),
        text("parameters"),
        *(real(name) for name in PIVOTS),
        *(real(name, nullable=True) for name in ("rho0", "kappa", "kappa_star", "s")),
    ]


def make_mechanism() -> None:
    op.create_table(
        "mechanism",
        *mechanism(),
        sa.PrimaryKeyConstraint("id", name="pk_mechanism"),
        sa.UniqueConstraint("name", name="uq_mechanism_name"),
        sa.UniqueConstraint("id", "series", name="uq_mechanism_id_series"),
        rule("ck_mechanism_parameters", "json_valid(parameters) AND json_type(parameters) = 'object'"),
        rule("ck_mechanism_pivots", " AND ".join(f"{name} IN (0, 1)" for name in PIVOTS if name.endswith("w"))),
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


def number(blob: bytes, place: int) -> float:
    """Return the double at a place of a blob, which SQLite cannot read by itself."""
    return struct.unpack_from("<d", blob, 8 * place)[0]


def upgrade() -> None:
    for index in ("ix_mechanism_kind", "ix_mechanism_batch"):
        op.drop_index(index, table_name="mechanism", if_exists=True)  # an interrupted build has none
    op.execute("PRAGMA legacy_alter_table = ON")  # what refers to the table goes on to mean the one of that name
    op.rename_table("mechanism", "old_mechanism")
    op.execute("PRAGMA legacy_alter_table = OFF")
    make_mechanism()
    op.get_bind().connection.driver_connection.create_function("number", 2, number)
    names = [column.name for column in mechanism()]
    values = [f"number(pivots, {PIVOTS.index(name)})" if name in PIVOTS else name for name in names]
    op.execute(f"INSERT INTO mechanism ({', '.join(names)}) SELECT {', '.join(values)} FROM old_mechanism")
    op.drop_table("old_mechanism")
    op.create_index("ix_mechanism_kind", "mechanism", ["series", "family", "configuration"])
    op.create_index("ix_mechanism_batch", "mechanism", ["batch_id"])
    op.create_table(
        "description",
        *(text(name) for name in ("table_name", "column_name", "type", "unit", "meaning")),
        sa.PrimaryKeyConstraint("table_name", "column_name", name="pk_description"),
        sqlite_strict=True,
    )
    op.execute("ANALYZE")
