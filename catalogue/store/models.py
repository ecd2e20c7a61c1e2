"""The tables: what was drawn, which mechanisms were kept, what each guides and how far; specimens of collections.

A mechanism is stored once, in its canonical frame (pole at the origin, pole tangent along +x, unit inflection
circle), and so without a length unit.  A guide has one `Reach` per decade of relative deviation; everything in a
reach but its stroke is a multiple of the stroke, which is what a request filters and ranks by.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from sqlalchemy import (
    BLOB,
    INTEGER,
    REAL,
    TEXT,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    MetaData,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

Key = Annotated[int, mapped_column(primary_key=True)]


class Base(DeclarativeBase):
    """Base of the tables: SQLite's own types, and a name for every constraint, so that an error names its rule."""

    type_annotation_map: ClassVar[dict[type, Any]] = {float: REAL, str: TEXT, int: INTEGER, bool: INTEGER, bytes: BLOB}
    metadata = MetaData(
        naming_convention={
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        }
    )


class Batch(Base):
    """One block of a sampling plan: where its mechanisms come from, and the unit in which a build resumes.

    A block holds fewer guides than `wanted` if it has no more that are worth keeping.
    """

    __tablename__ = "batch"

    id: Mapped[Key]
    series: Mapped[str]
    member: Mapped[str]
    plugin: Mapped[str]
    plugin_version: Mapped[str]
    plan: Mapped[str]
    seed: Mapped[int]
    number: Mapped[int]
    drawn: Mapped[int]
    kept: Mapped[int]
    guides: Mapped[int]
    wanted: Mapped[int]

    __table_args__ = (
        UniqueConstraint("series", "member", "seed", "number", "plan"),
        CheckConstraint("number >= 0", name="number"),
        CheckConstraint("drawn >= 0 AND kept >= 0 AND guides >= 0 AND wanted >= guides", name="counts"),
        {"sqlite_strict": True},
    )


class Mechanism(Base):
    """A linkage at its design position: pivots (dyad, (fixed, moving), (x, y, w)) and the curvature found there."""

    __tablename__ = "mechanism"

    id: Mapped[Key]
    batch_id: Mapped[int | None] = mapped_column(ForeignKey("batch.id", ondelete="CASCADE"))  # NULL: entered by hand
    family: Mapped[str]
    configuration: Mapped[str]
    series: Mapped[str]
    member: Mapped[str]
    name: Mapped[str | None]
    parameters: Mapped[str]
    pivots: Mapped[bytes]
    rho0: Mapped[float | None]  # NULL: the pole is at infinity
    kappa: Mapped[float | None]
    kappa_star: Mapped[float | None]
    s: Mapped[float | None]

    __table_args__ = (
        UniqueConstraint("name"),
        UniqueConstraint("id", "series"),  # what a guide refers to
        # `AND` keeps json_type from raising on text that is not JSON at all.
        CheckConstraint("json_valid(parameters) AND json_type(parameters) = 'object'", name="parameters"),
        CheckConstraint("length(pivots) > 0 AND length(pivots) % 8 = 0", name="pivots"),
        CheckConstraint("rho0 IS NULL OR rho0 > 0", name="rho0"),
        CheckConstraint(
            "(kappa IS NULL) = (kappa_star IS NULL) AND (kappa_star IS NULL) = (s IS NULL)", name="curvature_whole"
        ),
        # 1/R* - 1/R = 1/rho0: the two cubics belong to one inflection circle.
        CheckConstraint(
            "rho0 IS NULL OR abs(kappa_star - kappa - 1 / rho0) <= 1e-9 * (1 + abs(kappa) + abs(kappa_star))",
            name="curvature",
        ),
        Index("ix_mechanism_kind", "series", "family", "configuration"),
        Index("ix_mechanism_batch", "batch_id"),
        {"sqlite_strict": True},
    )


class Guide(Base):
    """A guided element with its nominal line or circle, at the design position in the canonical frame.

    Kinds: the coupler carries a point along a ``line`` or a ``circle``; or it carries a straight ``slot`` or a circular
    ``arc`` over a fixed point; or the point runs to the pole and back along one line or circle, ``return-line`` or
    ``return-circle``.  A slot is described in the inverse motion: x, y is the fixed point, the tangent that of
    its path in the coupler, and so are its reaches.  `leading` is c in v = c u^m, by which it leaves its nominal
    beside order m - 1 (m = contact_order + 1, canonical units); NULL if it never does, or has no series.
    `cover` is its position in the coverage order of its member and kind: those before K, of each, are a cover of all
    that are stored, the finer the larger K is.  Named guides come first.
    """

    __tablename__ = "guide"

    id: Mapped[Key]
    mechanism_id: Mapped[int]
    series: Mapped[str]  # that of the mechanism, repeated here and in `Reach`, which is read without it
    kind: Mapped[str]
    label: Mapped[str]
    x: Mapped[float]
    y: Mapped[float]
    tangent_x: Mapped[float]
    tangent_y: Mapped[float]
    curvature: Mapped[float]
    contact_order: Mapped[int]
    inflections: Mapped[int]
    leading: Mapped[float | None]
    cover: Mapped[int]

    __table_args__ = (
        ForeignKeyConstraint(["mechanism_id", "series"], ["mechanism.id", "mechanism.series"], ondelete="CASCADE"),
        UniqueConstraint("id", "kind", "series", "cover"),  # what a reach refers to, so that the two cannot differ
        CheckConstraint("kind IN ('line', 'circle', 'slot', 'arc', 'return-line', 'return-circle')", name="kind"),
        # The square's error is twice the norm's; sqrt is missing from many builds of SQLite.
        CheckConstraint("abs(tangent_x * tangent_x + tangent_y * tangent_y - 1) < 2e-9", name="tangent"),
        CheckConstraint("(kind IN ('line', 'slot', 'return-line')) = (curvature = 0)", name="curvature"),
        CheckConstraint("contact_order >= 2", name="contact_order"),
        CheckConstraint("inflections >= 0", name="inflections"),
        CheckConstraint("cover >= 0", name="cover"),
        Index("ix_guide_mechanism", "mechanism_id"),
        {"sqlite_strict": True},
    )


class Reach(Base):
    """The longest stroke a guide holds within a relative deviation of 10**level, and what was measured over it.

    The stroke is a chord in canonical units, `sweep` the stroke times the curvature of the fitted nominal; the other
    lengths are multiples of the stroke.  Boxes are those of the pivots at finite distance, in the guide's frame (the
    path runs from (0, 0) to (1, 0)).  Bit i of `rotates`: crank i + 1 turns fully.
    `drive_angle` and `rotation` are those of the better driving crank and of the coupler over the stroke [deg].
    `half` and `centre` are the window that was traced: half its length along the tangent, canonical units, and where
    its middle lies, in halves from the design position.
    """

    __tablename__ = "reach"

    guide_id: Mapped[Key]
    level: Mapped[Key]
    kind: Mapped[str]
    series: Mapped[str]
    cover: Mapped[int]
    stroke: Mapped[float]
    half: Mapped[float]
    centre: Mapped[float]
    deviation: Mapped[float]
    sweep: Mapped[float]
    size: Mapped[float]
    max_link: Mapped[float | None]  # NULL: the family has no link between two pivots at finite distance
    min_link: Mapped[float | None]
    max_ground: Mapped[float | None]
    max_arm: Mapped[float]
    min_transmission: Mapped[float]
    rotates: Mapped[int]
    fixed_x0: Mapped[float | None]  # NULL, all four: every fixed pivot is at infinity
    fixed_y0: Mapped[float | None]
    fixed_x1: Mapped[float | None]
    fixed_y1: Mapped[float | None]
    all_x0: Mapped[float]
    all_y0: Mapped[float]
    all_x1: Mapped[float]
    all_y1: Mapped[float]
    drive_angle: Mapped[float | None]  # NULL without a crank, and in rows of revision 0001
    rotation: Mapped[float | None]

    __table_args__ = (
        ForeignKeyConstraint(
            ["guide_id", "kind", "series", "cover"],
            ["guide.id", "guide.kind", "guide.series", "guide.cover"],
            ondelete="CASCADE",
        ),
        CheckConstraint("level BETWEEN -12 AND -1", name="level"),
        CheckConstraint("stroke > 0", name="stroke"),
        CheckConstraint("half > 0 AND abs(centre) < 1", name="window"),
        CheckConstraint("deviation >= 0", name="deviation"),
        CheckConstraint("sweep >= 0 AND (kind IN ('line', 'slot', 'return-line')) = (sweep = 0)", name="sweep"),
        CheckConstraint("size > 0", name="size"),
        CheckConstraint("max_link > 0", name="max_link"),
        CheckConstraint("min_link > 0", name="min_link"),
        CheckConstraint("max_ground >= 0", name="max_ground"),
        CheckConstraint("max_arm >= 0", name="max_arm"),
        CheckConstraint("min_transmission BETWEEN 0 AND 90", name="min_transmission"),
        CheckConstraint("rotates BETWEEN 0 AND 3", name="rotates"),
        # A box with some sides missing compares as NULL, which a CHECK lets pass: hence coalesce.
        CheckConstraint(
            "coalesce(fixed_x0 <= fixed_x1 AND fixed_y0 <= fixed_y1,"
            " fixed_x0 IS NULL AND fixed_y0 IS NULL AND fixed_x1 IS NULL AND fixed_y1 IS NULL)",
            name="fixed_box",
        ),
        CheckConstraint("all_x0 <= all_x1 AND all_y0 <= all_y1", name="all_box"),
        Index("ix_reach_cover", "kind", "level", "cover"),  # a search reads the first of a level or two
        {"sqlite_strict": True},
    )


class SpecimenRow(Base):
    """A specimen of a collection, scale-free: lengths among its metrics are multiples of the stroke, so is `deviation`.

    `block` says in which block of the collection's draws it was drawn, from which a build that was interrupted goes on.
    """

    __tablename__ = "specimens"

    id: Mapped[Key]
    collection: Mapped[str]
    family: Mapped[str]
    series: Mapped[str]
    configuration: Mapped[str]
    kind: Mapped[str]
    block: Mapped[int]
    deviation: Mapped[float]
    parameters: Mapped[str]
    metrics: Mapped[str]

    __table_args__ = (
        CheckConstraint("kind IN ('line', 'circle')", name="kind"),
        CheckConstraint("block >= 0", name="block"),
        CheckConstraint("deviation >= 0", name="deviation"),
        CheckConstraint("json_valid(parameters) AND json_type(parameters) = 'object'", name="parameters"),
        CheckConstraint("json_valid(metrics) AND json_type(metrics) = 'object'", name="metrics"),
        Index("ix_specimens_deviation", "collection", "kind", "deviation"),
        {"sqlite_strict": True},
    )


class Setting(Base):
    """The state of the build: seed, requested count, whether it is complete, the version that made it."""

    __tablename__ = "setting"

    key: Mapped[str] = mapped_column(primary_key=True)
    value: Mapped[str]

    __table_args__ = ({"sqlite_strict": True},)
