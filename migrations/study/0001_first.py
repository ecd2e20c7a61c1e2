"""The results of a study: requests, results by round, answers."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def text(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.TEXT, nullable=nullable)


def real(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.REAL, nullable=nullable)


def whole(name: str, nullable: bool = False) -> sa.Column:
    return sa.Column(name, sa.INTEGER, nullable=nullable)


def upgrade() -> None:
    op.create_table(
        "request",
        sa.Column("id", sa.INTEGER, nullable=False, primary_key=True),
        text("request"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_request")),
        sa.UniqueConstraint("request", name=op.f("uq_request_request")),
        sqlite_strict=True,
    )
    op.create_table(
        "result",
        whole("request_id"),
        whole("round"),
        text("status"),
        text("reason", True),
        text("advice", True),
        real("cost", True),
        real("seconds"),
        sa.PrimaryKeyConstraint("request_id", "round", name=op.f("pk_result")),
        sa.ForeignKeyConstraint(["request_id"], ["request.id"], name=op.f("fk_result_request"), ondelete="CASCADE"),
        sa.CheckConstraint("status IN ('answers', 'none', 'failed')", name=op.f("ck_result_status")),
        sa.CheckConstraint("round >= 0", name=op.f("ck_result_round")),
        sa.CheckConstraint("advice IS NULL OR json_valid(advice)", name=op.f("ck_result_advice")),
        sqlite_strict=True,
    )
    op.create_table(
        "answer",
        whole("request_id"),
        whole("round"),
        whole("place"),
        text("code"),
        text("record"),
        sa.PrimaryKeyConstraint("request_id", "round", "place", name=op.f("pk_answer")),
        sa.ForeignKeyConstraint(
            ["request_id", "round"],
            ["result.request_id", "result.round"],
            name=op.f("fk_answer_result"),
            ondelete="CASCADE",
        ),
        sa.CheckConstraint("place >= 0", name=op.f("ck_answer_place")),
        sa.CheckConstraint("json_valid(record)", name=op.f("ck_answer_record")),
        sqlite_strict=True,
    )
    op.create_index("ix_answer_code", "answer", ["code"])
    op.create_table(
        "setting",
        text("key"),
        text("value"),
        sa.PrimaryKeyConstraint("key", name=op.f("pk_setting")),
        sqlite_strict=True,
    )
