"""The tables: batches, mechanisms, their guides and reaches.

Specimens of collections.

A mechanism is stored once, in its canonical frame (pole at the origin, pole tangent along +x, unit
inflection circle; of parallel cranks, which have no pole, the height of crank 1 is the unit), and
so without a length unit.  A guide has one `Reach` per decade of relative deviation; everything in a
reach but its stroke is a multiple of the stroke, which is what a request filters and ranks by.

The comment of a column is its meaning, then its unit in brackets: [canonical], [1/canonical],
[stroke], [deg]; texts, counts and other dimensionless values have none.  A file contains these
comments as its description (`schema`).
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from sqlalchemy import (
    INTEGER,
    REAL,
    TEXT,
    CheckConstraint,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    MetaData,
    Select,
    UniqueConstraint,
    select,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, MappedColumn, mapped_column

from ..quantities import STORED, Stored
from .database import PIVOT_NAMES

Key = Annotated[int, mapped_column(primary_key=True)]


class Base(DeclarativeBase):
    """Base of the tables: the types of SQLite, and named constraints, for messages of errors."""

    type_annotation_map: ClassVar[dict[type, Any]] = {float: REAL, str: TEXT, int: INTEGER}
    metadata = MetaData(
        naming_convention={
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(referred_table_name)s",
            "pk": "pk_%(table_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        }
    )


class Batch(Base):
    """A block of a sampling plan: origin of its mechanisms, the unit in which a build resumes.

    A block holds fewer guides than `wanted` if it has no more that are worth keeping.
    """

    __tablename__ = "batch"

    id: Mapped[Key] = mapped_column(comment="number of the block")
    series: Mapped[str] = mapped_column(comment="code of the series that was drawn")
    member: Mapped[str] = mapped_column(comment="member of the series that was drawn")
    plugin: Mapped[str] = mapped_column(comment="plugin that brought the series")
    plugin_version: Mapped[str] = mapped_column(comment="version of that plugin")
    plan: Mapped[str] = mapped_column(comment="version of the way of drawing")
    seed: Mapped[int] = mapped_column(comment="seed of the sampling")
    number: Mapped[int] = mapped_column(comment="which block of its member it is, from 0")
    drawn: Mapped[int] = mapped_column(comment="linkages drawn")
    kept: Mapped[int] = mapped_column(comment="mechanisms stored")
    guides: Mapped[int] = mapped_column(comment="guides stored")
    wanted: Mapped[int] = mapped_column(comment="guides asked for")

    __table_args__ = (
        UniqueConstraint("series", "member", "seed", "number", "plan"),
        CheckConstraint("number >= 0", name="number"),
        CheckConstraint("drawn >= 0 AND kept >= 0 AND guides >= 0 AND wanted >= guides", name="counts"),
        {"sqlite_strict": True},
    )


class Mechanism(Base):
    """A linkage at its design position: its pivots and the curvature found there."""

    __tablename__ = "mechanism"

    id: Mapped[Key] = mapped_column(comment="number of the mechanism")
    batch_id: Mapped[int | None] = mapped_column(
        ForeignKey("batch.id", ondelete="CASCADE"),
        comment="block of a sampling plan it was drawn in; NULL: entered by hand",
    )
    family: Mapped[str] = mapped_column(comment="which dyads it has, such as four-bar")
    configuration: Mapped[str] = mapped_column(comment="letters of its dyads")
    series: Mapped[str] = mapped_column(comment="code of its series; none: of a family that no registered series has")
    member: Mapped[str] = mapped_column(comment="member of the series")
    name: Mapped[str | None] = mapped_column(comment="name of a design entered by hand")
    parameters: Mapped[str] = mapped_column(comment="free parameters of the member, by name, as a JSON object")
    fixed_1_x: Mapped[float] = mapped_column(comment="x of A1, fixed pivot of dyad 1 [canonical]")
    fixed_1_y: Mapped[float] = mapped_column(comment="y of A1, fixed pivot of dyad 1 [canonical]")
    fixed_1_w: Mapped[float] = mapped_column(comment="1; 0: A1, fixed pivot of dyad 1, is at infinity towards (x, y)")
    moving_1_x: Mapped[float] = mapped_column(comment="x of A1*, moving pivot of dyad 1 [canonical]")
    moving_1_y: Mapped[float] = mapped_column(comment="y of A1*, moving pivot of dyad 1 [canonical]")
    moving_1_w: Mapped[float] = mapped_column(
        comment="1; 0: A1*, moving pivot of dyad 1, is at infinity towards (x, y)"
    )
    fixed_2_x: Mapped[float] = mapped_column(comment="x of A2, fixed pivot of dyad 2 [canonical]")
    fixed_2_y: Mapped[float] = mapped_column(comment="y of A2, fixed pivot of dyad 2 [canonical]")
    fixed_2_w: Mapped[float] = mapped_column(comment="1; 0: A2, fixed pivot of dyad 2, is at infinity towards (x, y)")
    moving_2_x: Mapped[float] = mapped_column(comment="x of A2*, moving pivot of dyad 2 [canonical]")
    moving_2_y: Mapped[float] = mapped_column(comment="y of A2*, moving pivot of dyad 2 [canonical]")
    moving_2_w: Mapped[float] = mapped_column(
        comment="1; 0: A2*, moving pivot of dyad 2, is at infinity towards (x, y)"
    )
    rho0: Mapped[float | None] = mapped_column(
        comment="diameter of the inflection circle; NULL: the pole is at infinity [canonical]"
    )
    kappa: Mapped[float | None] = mapped_column(comment="1/R of the cubics of stationary curvature [1/canonical]")
    kappa_star: Mapped[float | None] = mapped_column(comment="1/R*; 1/R* - 1/R = 1/rho0 [1/canonical]")
    s: Mapped[float | None] = mapped_column(comment="1/S of the cubics [1/canonical]")

    __table_args__ = (
        UniqueConstraint("name"),
        UniqueConstraint("id", "series"),  # target of the foreign key of a guide
        # `AND` keeps json_type from raising on text that is not JSON at all.
        CheckConstraint("json_valid(parameters) AND json_type(parameters) = 'object'", name="parameters"),
        CheckConstraint(
            "fixed_1_w IN (0, 1) AND moving_1_w IN (0, 1) AND fixed_2_w IN (0, 1) AND moving_2_w IN (0, 1)",
            name="pivots",
        ),
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
    """A guided element and its nominal at the design position, in the canonical frame.

    Kinds: the coupler carries a point along a ``line`` or a ``circle``; or it carries a straight
    ``slot`` or a circular ``arc`` over a fixed point; or the point runs to the pole and back along
    one line or circle, ``return-line`` or ``return-circle``.  A slot is described in the inverse
    motion: x, y is the fixed point, the tangent that of its path in the coupler, and so are its
    reaches.  The first K guides of each member and kind, in the order `cover`, cover all stored
    ones, more finely for larger K.  Named guides come first.
    """

    __tablename__ = "guide"

    id: Mapped[Key] = mapped_column(comment="number of the guide, as `catalogue show` takes it")
    mechanism_id: Mapped[int] = mapped_column(comment="mechanism whose coupler guides")
    series: Mapped[str] = mapped_column(comment="code of the series of the mechanism")
    kind: Mapped[str] = mapped_column(
        comment="what is guided along what: line, circle, slot, arc, return-line, return-circle"
    )
    label: Mapped[str] = mapped_column(comment="which element of the series it is")
    x: Mapped[float] = mapped_column(comment="guided point; of a slot the fixed point it slides on [canonical]")
    y: Mapped[float] = mapped_column(comment="guided point; of a slot the fixed point it slides on [canonical]")
    tangent_x: Mapped[float] = mapped_column(comment="direction of the path at the design position, a unit vector")
    tangent_y: Mapped[float] = mapped_column(comment="direction of the path at the design position, a unit vector")
    curvature: Mapped[float] = mapped_column(
        comment="of the nominal, positive to the left of the tangent; 0: a line [1/canonical]"
    )
    contact_order: Mapped[int] = mapped_column(comment="order of contact of the path with its nominal; 99: exact")
    inflections: Mapped[int] = mapped_column(
        comment="inflections merged at the design position, of a named guide those over its usual stroke"
    )
    leading: Mapped[float | None] = mapped_column(
        comment="c in v = c u^m, m = contact_order + 1, by which it leaves its nominal; NULL: never, or has no series"
    )
    cover: Mapped[int] = mapped_column(
        comment="place in the order in which the guides of its member and kind cover them, from 0"
    )

    __table_args__ = (
        ForeignKeyConstraint(["mechanism_id", "series"], ["mechanism.id", "mechanism.series"], ondelete="CASCADE"),
        UniqueConstraint("id", "kind", "series", "cover"),  # target of the foreign key of a reach, so that both agree
        CheckConstraint("kind IN ('line', 'circle', 'slot', 'arc', 'return-line', 'return-circle')", name="kind"),
        # The square's error is twice the norm's; sqrt is missing from many builds of SQLite.
        CheckConstraint("abs(tangent_x * tangent_x + tangent_y * tangent_y - 1) < 2e-9", name="tangent"),
        CheckConstraint("(kind IN ('line', 'slot', 'return-line')) = (curvature = 0)", name="curvature"),
        CheckConstraint("contact_order >= 1", name="contact_order"),
        CheckConstraint("inflections >= 0", name="inflections"),
        CheckConstraint("cover >= 0", name="cover"),
        Index("ix_guide_mechanism", "mechanism_id"),
        {"sqlite_strict": True},
    )


def _measured(column: Stored) -> MappedColumn[Any]:
    return mapped_column(REAL, nullable=column.is_nullable, comment=column.comment)


class Reach(Base):
    """The longest stroke of a guide within a relative deviation of 10**level, with its measures.

    Boxes are those of the pivots at finite distance, in the guide's frame: the path runs from (0,
    0) to (1, 0), and an arc bulges to +y.
    """

    __tablename__ = "reach"

    guide_id: Mapped[Key] = mapped_column(comment="guide that reaches")
    level: Mapped[Key] = mapped_column(comment="decimal exponent of the deviation it holds over the stroke")
    kind: Mapped[str] = mapped_column(comment="kind of the guide")
    series: Mapped[str] = mapped_column(comment="code of the series of the mechanism")
    cover: Mapped[int] = mapped_column(comment="that of the guide")
    stroke: Mapped[float] = mapped_column(comment="longest stroke, a chord of the path [canonical]")
    half: Mapped[float] = mapped_column(comment="half the length of the traced window along the tangent [canonical]")
    centre: Mapped[float] = mapped_column(comment="middle of that window from the design position, in halves of it")
    deviation: Mapped[float] = mapped_column(
        comment="half the width of the narrowest strip or annulus that holds the path [stroke]"
    )
    sweep: Mapped[float] = mapped_column(comment="stroke times curvature of the circle that fits best; 0: a line")
    vars().update({name: _measured(column) for name, column in STORED.items() if column.range.check})
    rotates: Mapped[int] = mapped_column(comment="cranks that turn fully: 1 the first, 2 the second, 3 both, 0 none")
    fixed_x0: Mapped[float | None] = mapped_column(
        comment="box of the fixed pivots, left side; NULL: all are at infinity [stroke]"
    )
    fixed_y0: Mapped[float | None] = mapped_column(comment="its lower side [stroke]")
    fixed_x1: Mapped[float | None] = mapped_column(comment="its right side [stroke]")
    fixed_y1: Mapped[float | None] = mapped_column(comment="its upper side [stroke]")
    all_x0: Mapped[float] = mapped_column(comment="box of all pivots, left side [stroke]")
    all_y0: Mapped[float] = mapped_column(comment="its lower side [stroke]")
    all_x1: Mapped[float] = mapped_column(comment="its right side [stroke]")
    all_y1: Mapped[float] = mapped_column(comment="its upper side [stroke]")
    vars().update({name: _measured(column) for name, column in STORED.items() if not column.range.check})

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
        *(
            CheckConstraint(f"{name} {column.range.check}", name=name)
            for name, column in STORED.items()
            if column.range.check
        ),
        CheckConstraint("rotates BETWEEN 0 AND 3", name="rotates"),
        # A box with some sides missing compares as NULL, which a CHECK lets pass: hence coalesce.
        CheckConstraint(
            "coalesce(fixed_x0 <= fixed_x1 AND fixed_y0 <= fixed_y1,"
            " fixed_x0 IS NULL AND fixed_y0 IS NULL AND fixed_x1 IS NULL AND fixed_y1 IS NULL)",
            name="fixed_box",
        ),
        CheckConstraint("all_x0 <= all_x1 AND all_y0 <= all_y1", name="all_box"),
        Index("ix_reach_cover", "kind", "level", "cover"),  # a search reads the first guides of one or two levels
        {"sqlite_strict": True},
    )


class SpecimenRow(Base):
    """A specimen of a collection, scale-free.

    An interrupted build continues after the last `block`.
    """

    __tablename__ = "specimens"

    id: Mapped[Key] = mapped_column(comment="number of the specimen")
    collection: Mapped[str] = mapped_column(comment="collection it belongs to")
    family: Mapped[str] = mapped_column(comment="family in the collection")
    series: Mapped[str] = mapped_column(comment="series in the collection")
    configuration: Mapped[str] = mapped_column(comment="configuration in the collection")
    kind: Mapped[str] = mapped_column(comment="what it guides its point along: line, circle")
    block: Mapped[int] = mapped_column(comment="which block of the draws it came from")
    place: Mapped[int] = mapped_column(comment="which of its block it is, from 0")
    deviation: Mapped[float] = mapped_column(comment="largest distance of the path from its nominal [stroke]")
    parameters: Mapped[str] = mapped_column(comment="what it is made from, by name, as a JSON object")
    metrics: Mapped[str] = mapped_column(
        comment="what was measured of it, by name, as a JSON object; lengths in strokes"
    )

    __table_args__ = (
        UniqueConstraint("collection", "family", "block", "place"),
        CheckConstraint("kind IN ('line', 'circle')", name="kind"),
        CheckConstraint("block >= 0", name="block"),
        CheckConstraint("place >= 0", name="place"),
        CheckConstraint("deviation >= 0", name="deviation"),
        CheckConstraint("json_valid(parameters) AND json_type(parameters) = 'object'", name="parameters"),
        CheckConstraint("json_valid(metrics) AND json_type(metrics) = 'object'", name="metrics"),
        Index("ix_specimens_deviation", "collection", "kind", "deviation"),
        {"sqlite_strict": True},
    )


class Description(Base):
    """Meaning of each table, view and column of this file.

    `catalogue.store.schema` fills it whenever a file is made or upgraded.
    """

    __tablename__ = "description"

    table_name: Mapped[str] = mapped_column(primary_key=True, comment="table or view")
    column_name: Mapped[str] = mapped_column(primary_key=True, comment="column; empty: all of the table or view")
    type: Mapped[str] = mapped_column(comment="INTEGER, REAL or TEXT")
    unit: Mapped[str] = mapped_column(
        comment="deg; stroke: in strokes; canonical: origin the pole, x axis the pole tangent, unit rho0"
    )
    meaning: Mapped[str] = mapped_column(comment="what it is, and what NULL means")

    __table_args__ = ({"sqlite_strict": True},)


class Setting(Base):
    """The state of the build: its request, and whether it is complete."""

    __tablename__ = "setting"

    key: Mapped[str] = mapped_column(
        primary_key=True, comment="what is kept: count, seed, series, complete, of collections their versions"
    )
    value: Mapped[str] = mapped_column(comment="as text")

    __table_args__ = ({"sqlite_strict": True},)


#: The pivots of a mechanism in the order of its array.
PIVOTS = tuple(getattr(Mechanism, name) for name in PIVOT_NAMES)

#: Columns needed to place a stored reach along a path.
COLUMNS = (
    Guide.id.label("id"),
    *(Mechanism.family, Mechanism.series, Mechanism.member, Mechanism.configuration, *PIVOTS),
    *(Guide.x, Guide.y, Guide.kind, Guide.label, Guide.contact_order),
    *(Reach.level, Reach.half, Reach.centre, Reach.stroke, Reach.sweep, Reach.deviation),
    *(Reach.__table__.c[name] for name in STORED),
)


def joined(*columns: Any) -> Select[Any]:
    """Return a select over reaches with their guides and mechanisms."""
    return (
        select(*columns)
        .select_from(Reach)
        .join(Guide, Guide.id == Reach.guide_id)
        .join(Mechanism, Mechanism.id == Guide.mechanism_id)
    )
