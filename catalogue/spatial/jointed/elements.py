"""Elements of a mechanism: bodies, joints and scalars in the design pose, in one frame and one
unit.

Bodies are named; ``"ground"`` stands still.  Every motion starts from the pose of the given hard
points, so no search for an assembly is needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from ...errors import InvalidRequest
from ...given import Stated, array, instance, number, several
from ..geometry.kinds import Kind

GROUND = "ground"
#: Unit vectors by axis name.
DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
#: A point or a direction: three numbers, or (n, 3) for a batch of n mechanisms.
Vector = Sequence[float] | Any


@dataclass(frozen=True, eq=False)
class Link(Stated):
    """A link with spherical joints at both ends (SS), between points of `a` and `b`.

    The link is no body; its rotation about itself is not counted as a freedom.
    """

    a: str
    from_: Vector
    b: str
    to: Vector
    name: str = ""


@dataclass(frozen=True, eq=False)
class Spherical(Stated):
    """A spherical joint (S): a point of `body` coincides with a point of `on`."""

    body: str
    at: Vector
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class Revolute(Stated):
    """A revolute joint (R) between `body` and `on`; axis through `at`, along `axis` or through
    `to`.
    """

    body: str
    at: Vector
    axis: Vector | None = None
    to: Vector | None = None
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class Screw(Revolute):
    """A screw joint (H): `body` advances along the axis by `lead` per turn, right-handed if
    positive.

    Its coordinate is the angle.  It must be stated before the other joints of its body.
    """

    lead: float = 0.0


@dataclass(frozen=True, eq=False)
class Prismatic(Stated):
    """A prismatic joint (P): `body` slides on `on` along `axis`, without turning."""

    body: str
    axis: Vector
    at: Vector = (0.0, 0.0, 0.0)
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class Cylindrical(Stated):
    """A cylindrical joint (C): `body` turns about and slides along an axis of `on`."""

    body: str
    at: Vector
    axis: Vector | None = None
    to: Vector | None = None
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class OnGuide(Stated):
    """A point of `body` on a surface or a curve that is fixed to `on`.

    Parameters
    ----------
    guide : str or Kind
        A name of `KINDS`, or a user's own kind.
    parameters, origin, quaternion
        Shape, and position and orientation of its local axes in the design pose; see `Guides`.
    """

    body: str
    at: Vector
    guide: str | Kind
    parameters: Sequence[float] = ()
    origin: Vector = (0.0, 0.0, 0.0)
    quaternion: Vector = (1.0, 0.0, 0.0, 0.0)
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class KeepAngle(Stated):
    """A constant angle between a direction of `a` and one of `b`.

    One such condition makes the cross of a Cardan joint; three suppress all rotation, as a
    Prismatic joint does.
    """

    a: str
    axis_a: Vector
    b: str
    axis_b: Vector
    name: str = ""


@dataclass(frozen=True, eq=False)
class Universal(Stated):
    """A universal joint (U): two points coincide, `axis` and `axis_on` keep their angle."""

    body: str
    at: Vector
    axis: Vector
    axis_on: Vector
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class Fixed(Stated):
    """A rigid connection: `body` moves with `on`, as a hub that is screwed to a carrier."""

    body: str
    on: str = GROUND
    at: Vector = (0.0, 0.0, 0.0)
    name: str = ""

    axis: ClassVar[Vector] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Coupling(Stated):
    """A sum of scalars that is constant in every motion: gears, a rack and pinion.

    Examples
    --------
    >>> Coupling(Joint("rack") - Joint("pinion") * 7.5)  # the rack moves by 7.5 per radian
    """

    scalar: Sum
    name: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        instance("scalar of a Coupling", self.scalar, Sum)


Element = Link | Spherical | Revolute | Prismatic | Cylindrical | OnGuide | KeepAngle | Universal | Fixed | Coupling


def joined_bodies(x: Element) -> tuple[str, str]:
    """Return the two bodies that an element joins; empty names for a coupling."""
    if isinstance(x, Coupling):
        return GROUND, GROUND
    return (x.a, x.b) if isinstance(x, Link | KeepAngle) else (x.body, x.on)


# -- scalars, to drive, hold or read --------------------------------------------------------------
class Summable(Stated):
    """Base class of scalars: sums and multiples of them are a `Sum`."""

    def __add__(self, other: Any) -> Sum:
        return Sum((self, other))  # type: ignore[arg-type]  # a scalar

    def __sub__(self, other: Any) -> Sum:
        return Sum((self, other), (1.0, -1.0))  # type: ignore[arg-type]

    def __mul__(self, factor: Any) -> Sum:
        return Sum((self,), (factor,))  # type: ignore[arg-type]

    __rmul__ = __mul__

    def __truediv__(self, divisor: Any) -> Sum:
        return Sum((self,), (1 / number("a divisor of a scalar", divisor),))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Joint(Summable):
    """Coordinate of the joint that carries `body`: angle [rad] or slide, 0 in the design pose.

    For a cylindrical joint `index` 0 is the angle, 1 the slide.
    """

    body: str
    index: int = 0


@dataclass(frozen=True, eq=False)
class Travel(Summable):
    """Travel of a point of `body` along a direction, or ``"x"``, ``"y"``, ``"z"``."""

    body: str
    point: Vector
    along: Vector | str = "z"


@dataclass(frozen=True, eq=False)
class Length(Summable):
    """Distance between a point of `a` and one of `b`.

    With `link` it is the length of that link, which becomes variable.
    """

    a: str = ""
    from_: Vector = ()
    b: str = ""
    to: Vector = ()
    link: str = ""


@dataclass(frozen=True, eq=False)
class Angle(Summable):
    """Rotation of a direction of `body` about the axis `about`, 0 in the design pose [rad]."""

    body: str
    direction: Vector
    about: Vector


@dataclass(frozen=True, eq=False)
class GuideCoordinate(Summable):
    """Coordinate ``"u"`` or ``"w"`` of the point on a guide, by the element's name."""

    guide: str
    coordinate: str = "u"


@dataclass(frozen=True, eq=False)
class Sum(Summable):
    """Weighted sum of scalars: heave, roll, the steering of two wheels.

    Parameters
    ----------
    parts : sequence of scalars
        Lengths, angles, or both; the sum of both is a length.  Nested sums are expanded.
    weights : sequence of float
        One for each part, 1 by default.  In a sum with lengths, the weight of an angle is a length
        per radian.

    Examples
    --------
    >>> roll = Travel("left", (0, 760, 0)) - Travel("right", (0, -760, 0))
    """

    parts: Sequence[Scalar]
    weights: Sequence[float] = ()

    def __post_init__(self) -> None:
        parts = several("parts of a Sum", self.parts, Scalar)
        weights = array("weights of a Sum", self.weights or (1.0,) * len(parts), (len(parts),), finite=True).tolist()
        if not parts or not all(weights):
            raise InvalidRequest("a Sum needs parts, and weights that are not 0")
        flat = [
            (one, weight * own)
            for part, weight in zip(parts, weights, strict=True)
            for one, own in (zip(part.parts, part.weights, strict=True) if isinstance(part, Sum) else [(part, 1.0)])
        ]
        object.__setattr__(self, "parts", tuple(one for one, _ in flat))
        object.__setattr__(self, "weights", tuple(weight for _, weight in flat))


Scalar = Joint | Travel | Length | Angle | GuideCoordinate | Sum


def expand_sums(scalars: Iterable[Scalar]) -> Iterator[Scalar]:
    """Yield scalars; of a sum its parts."""
    for scalar in scalars:
        yield from scalar.parts if isinstance(scalar, Sum) else (scalar,)


def identity(scalar: Scalar) -> tuple[Any, ...]:
    """Return a key of a scalar; equal scalars, with exactly equal points, have equal keys."""
    kind = type(instance("what drives or is held", scalar, Scalar)).__name__
    if isinstance(scalar, Sum):
        return kind, *map(identity, scalar.parts), *scalar.weights
    given = vars(scalar)
    if isinstance(given.get("along"), str):
        given = {**given, "along": DIRECTIONS.get(given["along"], given["along"])}
    stated = {k: v if isinstance(v, str) else array(f"{kind}.{k.strip('_')}", v) for k, v in given.items()}
    return kind, *(v if isinstance(v, str) else (v.shape, v.tobytes()) for v in stated.values())


def title(scalar: Scalar) -> str:
    """Return the name of a scalar in headings: its kind and its body, link or guide."""
    if isinstance(scalar, Length):
        return f"Length {scalar.link or f'{scalar.a}-{scalar.b}'}"
    if isinstance(scalar, Sum):
        parts = zip(scalar.parts, scalar.weights, strict=True)
        return " ".join(
            f"{'+' if weight == 1 else '-' if weight == -1 else f'{weight:+g}'} {title(one)}" for one, weight in parts
        )
    return f"{type(scalar).__name__} {scalar.guide if isinstance(scalar, GuideCoordinate) else scalar.body}"
