"""What a mechanism is made of, as an engineer states it: everything in the design pose, in one
frame and one unit.

Bodies are named; ``"ground"`` stands still.  The pose in which the hard points are given is the
start of every motion, so that nothing has to be assembled by a search.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from ...errors import InvalidRequest
from ...given import Stated, array, instance, number, several
from ..geometry.kinds import Kind

GROUND = "ground"
#: Axes by their names.
DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
#: A point or a direction: three numbers, or (n, 3) for a batch of n mechanisms.
Vector = Sequence[float] | Any


@dataclass(frozen=True, eq=False)
class Link(Stated):
    """A link with spherical joints at both ends (SS): it keeps the distance of a point of `a` from
    one of `b`.

    Its idle rotation about itself is no freedom: the link is no body.
    """

    a: str
    from_: Vector
    b: str
    to: Vector
    name: str = ""


@dataclass(frozen=True, eq=False)
class Spherical(Stated):
    """A spherical joint (S): a point of `body` is one of `on`."""

    body: str
    at: Vector
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class Revolute(Stated):
    """A revolute joint (R) of `body` on `on`: axis through `at`, along `axis` or through `to`."""

    body: str
    at: Vector
    axis: Vector | None = None
    to: Vector | None = None
    on: str = GROUND
    name: str = ""


@dataclass(frozen=True, eq=False)
class Screw(Revolute):
    """A screw joint (H): `body` advances on `on` along the axis by `lead` a turn, right-handed if
    that is positive.

    Its coordinate is the angle.  It must carry its body: state it before the other joints of that
    body.
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
        A name of `KINDS`, or a kind of one's own.
    parameters, origin, quaternion
        As for `Guides`: shape, and where its local axes stand in the design pose.
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
    """A direction of `a` and one of `b` keep their angle: the cross of a Cardan joint, a third of a
    Prismatic one.
    """

    a: str
    axis_a: Vector
    b: str
    axis_b: Vector
    name: str = ""


@dataclass(frozen=True, eq=False)
class Universal(Stated):
    """A universal joint (U): a point of `body` is one of `on`, and `axis` of `body` keeps its angle
    to `axis_on`.
    """

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
    """Gears, a rack and a pinion: a sum of scalars keeps its value in every motion.

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


def joined(x: Element) -> tuple[str, str]:
    """Return the two bodies that an element joins; of a coupling none."""
    if isinstance(x, Coupling):
        return GROUND, GROUND
    return (x.a, x.b) if isinstance(x, Link | KeepAngle) else (x.body, x.on)


# -- scalars: what drives, is held, or is read off ----------------------------------------------
class Summable(Stated):
    """Base of scalars: they add up, and take factors, to a `Sum`."""

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
    """The coordinate of the joint that carries `body`, 0 in the design pose: angle [rad] of R,
    slide of P.

    Of a cylindrical joint `index` 0 is the angle, 1 the slide.
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
    """The distance of a point of `a` from one of `b`; with `link`, the length of that link, which
    is then free.
    """

    a: str = ""
    from_: Vector = ()
    b: str = ""
    to: Vector = ()
    link: str = ""


@dataclass(frozen=True, eq=False)
class Angle(Summable):
    """Turn of a direction of `body` about `about`, 0 in the design pose [rad]."""

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
        Lengths, angles, or both: then the sum is a length.  Sums among them are taken apart.
    weights : sequence of float
        One for each part; without any all are 1.  Of an angle beside lengths, lengths per radian.

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


def apart(scalars: Iterable[Scalar]) -> Iterator[Scalar]:
    """Yield scalars, of sums their parts."""
    for scalar in scalars:
        yield from scalar.parts if isinstance(scalar, Sum) else (scalar,)


def identity(scalar: Scalar) -> tuple[Any, ...]:
    """Return a key that equal scalars share, to the last digit of their points."""
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
