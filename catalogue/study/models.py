"""Tables of a results file: requests, their results by round, answers.

The result of the last round of a request is valid. Earlier results are kept: a killed study repeats
its decisions from them, so that its table equals that of an uninterrupted one.
"""

from __future__ import annotations

from typing import Any, ClassVar

from sqlalchemy import INTEGER, REAL, TEXT, CheckConstraint, ForeignKey, ForeignKeyConstraint, Index, MetaData
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from ..store.engine import Layout
from ..store.models import Base as CatalogueBase

#: Layout of a results file.
RESULTS = Layout("of a study", frozenset({"request", "result", "answer"}), "study", "catalogue.study.models")


class Base(DeclarativeBase):
    """Base of the tables, with the types and constraint names of a catalogue."""

    type_annotation_map: ClassVar[dict[type, Any]] = {float: REAL, str: TEXT, int: INTEGER}
    metadata = MetaData(naming_convention=CatalogueBase.metadata.naming_convention)


class RequestRow(Base):
    """A request, in the order of the study."""

    __tablename__ = "request"

    id: Mapped[int] = mapped_column(primary_key=True, comment="place in the study, from 1")
    request: Mapped[str] = mapped_column(unique=True, comment="the request as JSON")

    __table_args__ = ({"sqlite_strict": True},)


class ResultRow(Base):
    """The result of a request in a round."""

    __tablename__ = "result"

    request_id: Mapped[int] = mapped_column(ForeignKey("request.id", ondelete="CASCADE"), primary_key=True)
    round: Mapped[int] = mapped_column(primary_key=True, comment="round of the study, from 0")
    status: Mapped[str] = mapped_column(comment="answers, none, or failed: its worker was killed twice")
    reason: Mapped[str | None] = mapped_column(comment="why there is no answer")
    advice: Mapped[str | None] = mapped_column(comment="tested remedies as JSON: lists of option, value, asked")
    cost: Mapped[float | None] = mapped_column(comment="of the best answer, by the ranking of the request")
    seconds: Mapped[float] = mapped_column(comment="processor time of the search [s]")

    __table_args__ = (
        CheckConstraint("status IN ('answers', 'none', 'failed')", name="status"),
        CheckConstraint("round >= 0", name="round"),
        CheckConstraint("advice IS NULL OR json_valid(advice)", name="advice"),
        {"sqlite_strict": True},
    )


class AnswerRow(Base):
    """An answer, as `catalogue.find.answers` records it."""

    __tablename__ = "answer"

    request_id: Mapped[int] = mapped_column(primary_key=True)
    round: Mapped[int] = mapped_column(primary_key=True)
    place: Mapped[int] = mapped_column(primary_key=True, comment="place in the list, from 0")
    code: Mapped[str] = mapped_column(comment="code of the answer")
    record: Mapped[str] = mapped_column(comment="its record as JSON")

    __table_args__ = (
        ForeignKeyConstraint(["request_id", "round"], ["result.request_id", "result.round"], ondelete="CASCADE"),
        CheckConstraint("place >= 0", name="place"),
        CheckConstraint("json_valid(record)", name="record"),
        Index("ix_answer_code", "code"),
        {"sqlite_strict": True},
    )


class Setting(Base):
    """Versions of the package and of the catalogue, and whether the study is complete."""

    __tablename__ = "setting"

    key: Mapped[str] = mapped_column(primary_key=True)
    value: Mapped[str]

    __table_args__ = ({"sqlite_strict": True},)
