"""The motion of a sweep: poses, and quantities read off them with derivatives by the drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import factorial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import CatalogueError, InvalidRequest, one_line, quoted
from ...given import array, instance, pair, several, switch, text, whole
from ...kinematics.types import Array
from . import compiled
from .curve import Curve
from .elements import Length, Scalar, identity, title
from .hard_points import numbers
from .tree import PRISMATIC, UNKNOWNS
from .vectors import series

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from .axle import Wheel
    from .hard_points import HardPoints
    from .mechanism import Mechanism
    from .scalars import ScalarFunction


#: Ratio to the largest below which a singular value belongs to redundant conditions.
RANK_TOLERANCE = 1e-9
#: Highest derivative: the factorials of higher orders overflow.
MAX_ORDER = 170


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """Poses at the values of a drive; NaN where no pose exists.

    Readings are of shape (s, ...), or (n, s, ...) for a batch of n mechanisms.  With `order` they
    have a further axis of derivatives by the drive, (s, order + 1, ...), called reduced by
    Mangeron, Oğuztöreli and Plitea 1970.  `in_time` turns them into velocities and accelerations
    for a law of the drive.

    Attributes
    ----------
    drive : ndarray, shape (s,)
    states : ndarray, shape (n, s, numbers)
    ends : tuple of n pairs
        Lower and upper end: None if the drive reached all its values, else (value, reason).
    others : tuple of scalars
        Further drives; `other_values` (s, d) are their values, in the unit of the points or
        radians.
    held_values : ndarray, shape (n, s, h), optional
        Dimensionless values of all scalars but the last, where they differ from those of `curve`.
    stops : tuple of n tuples of str
        Positions of missing poses, with reasons.
    law : tuple, optional
        Series of `scalars` in a parameter, coefficients (order, n s or 1, f), and the unit of that
        parameter; derivatives are then by this parameter.
    """

    mechanism: Mechanism
    curve: Curve
    driven: Scalar
    held: tuple[Scalar, ...]
    drive: Array
    states: Array
    ends: tuple[Any, ...]
    _cache: dict[Any, Any] = field(default_factory=dict)
    others: tuple[Scalar, ...] = ()
    other_values: Array | None = None
    held_values: Array | None = None
    stops: tuple[tuple[str, ...], ...] = ()
    law: tuple[Array, float] | None = None

    @property
    def success(self) -> Array:
        """Whether a pose exists, shape (s,) or (n, s)."""
        return self._split_batch(np.isfinite(self.states).all(-1).reshape(-1))

    @property
    def drives(self) -> tuple[Scalar, ...]:
        """The driving scalars; over a grid the last one varies fastest."""
        return (*self.others, self.driven)

    @property
    def values(self) -> Array:
        """Values of all drives, shape (s, d), in the unit of the points or radians."""
        alone = self.drive[:, None]
        return alone if self.other_values is None else np.concatenate([self.other_values, alone], axis=1)

    def __repr__(self) -> str:
        n, s = self.states.shape[:2]
        drives = ", ".join(map(title, self.drives))
        poses, found = f"{n} mechanisms, {s} poses each" if n > 1 else f"{s} poses", int(self.success.sum())
        return f"<Motion by {drives}: {poses}, {found} of {n * s} reached>"

    def value(self, scalar: Scalar) -> Array:
        """Return the value of any scalar, such as a spring's length, (s,) [length, rad].

        Raises
        ------
        InvalidRequest
            If it refers to a link of variable length or a guide that is neither drive nor held.
        """
        from .instant import value

        return self._split_batch(value(self, instance("scalar", scalar, Scalar)))

    def ratio(self, scalar: Scalar, moving: Scalar, still: Sequence[Scalar] = ()) -> Array:
        """Return the motion ratio of two scalars, (s,), while other scalars are held.

        Parameters
        ----------
        scalar, moving : scalar
            Output and input; neither needs to be in the motion.
        still : sequence of scalars
            Held scalars; they must leave one freedom, which moves the output.

        Raises
        ------
        InvalidRequest
            If the ratio is not determined in any pose.
        """
        from .instant import ratio

        rates, reason = ratio(self, scalar, moving, several("still", still, Scalar))
        if reason and not np.isfinite(rates).any():
            raise InvalidRequest(reason)
        return self._split_batch(rates)

    def by(self, scalar: Scalar) -> Motion:
        """Return this motion with derivatives by one of its scalars, all others held.

        Parameters
        ----------
        scalar : scalar
            A driving or held one.

        Raises
        ------
        InvalidRequest
            If it is neither driving nor held.
        """
        names = self.stated
        if identity(scalar) not in names:
            raise InvalidRequest(f"{title(scalar)} neither drives nor is held in this motion")
        k = names.index(identity(scalar))
        row = np.eye(len(names))[k]
        return replace(self, law=(row[None, None], self.curve.system.scalars[k].unit), _cache=self._pose_cache())

    def in_time(self, rates: Any) -> Motion:
        """Return this motion with derivatives by time, for laws of its drives.

        Parameters
        ----------
        rates : array-like, shape (s, order, d), or (order, d) for all poses
            Velocity, acceleration, jerk ... of each drive; held scalars have none.

        Raises
        ------
        InvalidRequest
            If the shape does not match the drives and poses.
        """
        given, s, d = array("rates", rates, (None, None), (None, None, None)), len(self.drive), len(self.drives)
        given = given[None] if given.ndim == 2 else given
        if given.shape[0] not in (1, s) or given.shape[2] != d:
            raise InvalidRequest(f"rates must be of shape ({s}, order, {d}) or (order, {d}), not {given.shape}")
        units = np.array([x.unit for x in self.curve.system.scalars])
        law = np.zeros((given.shape[1], given.shape[0], len(units)))
        for k in range(given.shape[1]):
            law[k, :, len(units) - d :] = given[:, k] / factorial(k + 1)
        law = np.tile(law / units, (1, len(self.states) if given.shape[0] > 1 else 1, 1))
        return replace(self, law=(law, 1.0), _cache=self._pose_cache())

    @property
    def _is_compiled(self) -> bool:
        return self.curve.system.fast is not None

    def _pose_cache(self) -> dict[Any, Any]:
        """Return the cached values that depend on the poses only."""
        return {k: v for k, v in self._cache.items() if k in ("inverse", "basis", "twists", "stated", ("poses", 0))}

    def _parameter_series(self) -> tuple[Array, float]:
        """Return the series of scalars in the parameter and the unit of the parameter.

        The series are of shape (order, n s or 1, f).
        """
        if self.law is None and self.others:
            raise InvalidRequest("several scalars drive: say by which derivatives are, motion.by(drive), or in_time")
        return self.law or self.by(self.driven)._parameter_series()

    @property
    def drive_unit(self) -> str:
        """Unit in which the drive is shown: the unit of length, or degrees."""
        return "deg" if self._angular else self.mechanism.unit

    @property
    def drive_shown(self) -> Array:
        """The drive in the unit in which it is shown."""
        return np.asarray(np.degrees(self.drive) if self._angular else self.drive)

    @property
    def _angular(self) -> bool:
        return bool(self.curve.system.scalars[-1].angular)

    @property
    def index(self) -> pd.Index:
        """Shown values of the drives as an index, ``mechanism`` first for a batch."""
        import pandas as pd

        n, last = len(self.states), self.curve.system.scalars[-len(self.drives) :]
        units = ["deg" if s.angular else self.mechanism.unit for s in last]
        shown = [np.degrees(v) if s.angular else v for v, s in zip(self.values.T, last, strict=True)]
        called = map(title, self.drives) if self.others else ["drive"]
        names = [f"{name} [{unit}]" for name, unit in zip(called, units, strict=True)]
        if n > 1:
            arrays = [np.repeat(np.arange(n), len(self.drive)), *(np.tile(v, n) for v in shown)]
            return pd.MultiIndex.from_arrays(arrays, names=["mechanism", *names])
        return pd.MultiIndex.from_arrays(shown, names=names) if self.others else pd.Index(shown[0], name=names[0])

    def _split_batch(self, flat: Array) -> Array:
        n, s = self.states.shape[:2]
        out = flat.reshape(n, s, *flat.shape[1:])
        return np.asarray(out if n > 1 else out[0])

    def flat(self) -> tuple[Curve, Array]:
        """Return the curves and states of all poses, (n s, numbers)."""
        n, s = self.states.shape[:2]
        curve = self.curve.take(np.repeat(np.arange(n), s))
        if self.held_values is not None:
            curve = Curve(curve.system, self.held_values.reshape(n * s, -1))
        return curve, self.states.reshape(n * s, -1)

    def series(self, order: int) -> Array:
        """Return the unknowns as series in the drive, (order + 1, n s, unknowns): one linear solve
        per order.
        """
        order = whole("order", order, 0, MAX_ORDER)
        if order not in self._cache:
            curve, y = self.flat()
            system = curve.system
            width = system.rows + len(system.scalars)
            x = np.zeros((order + 1, len(y), system.unknowns))
            if order:
                law = self._parameter_series()[0]
                x[1] = (self.basis() @ law[0][..., None])[..., 0]
            for k in range(2, order + 1):
                rotation, shift = system.poses(y, x[: k + 1])
                ends, vectors = system.attached(rotation, shift)
                f = np.zeros((len(y), width))
                f[:, : system.rows] = system.residual(ends, vectors, rotation, shift)[k]
                every = system.numbered(y, x[: k + 1])
                for c, scalar in enumerate(system.scalars, system.rows):
                    f[:, c] = scalar.value(ends, vectors, every)[k]
                if k <= len(law):
                    f[:, system.rows :] -= law[k - 1]
                x[k] = -(self.inverse() @ f[..., None])[..., 0]
            self._cache[order] = x
        return np.asarray(self._cache[order])

    def inverse(self) -> Array:
        """Invert the Jacobian of conditions, held scalars and drive: (n s, unknowns, c + f).

        By least squares, where some conditions are implied by others.
        """
        if "inverse" not in self._cache:
            curve, y = self.flat()
            jacobian = curve.jacobian(y)
            good = np.isfinite(jacobian).all((1, 2))
            inverse = np.full_like(np.swapaxes(jacobian, 1, 2), np.nan)
            square = jacobian.shape[1] == jacobian.shape[2] and _is_regular(jacobian[good])
            inverse[good] = (
                np.linalg.inv(jacobian[good]) if square else np.linalg.pinv(jacobian[good], rcond=RANK_TOLERANCE)
            )
            self._cache["inverse"] = inverse
        return np.asarray(self._cache["inverse"])

    def _read(self, values: Array, unit: float) -> Array:
        """Convert series coefficients (order + 1, n s, ...) to derivatives in the user's units."""
        order = len(values) - 1
        drive = self._parameter_series()[1] if order else 1.0
        scale = np.array([unit * factorial(k) / drive**k for k in range(order + 1)])
        out = np.moveaxis(values * scale.reshape(-1, *[1] * (values.ndim - 1)), 0, 1)
        return self._split_batch(out if order else out[:, 0])

    def rows(self, reading: Any) -> Array:
        """Return a reading with one row per pose, mechanism after mechanism, (n s, ...)."""
        value, (n, s) = array("reading", reading), self.states.shape[:2]
        if n > 1 and value.shape[:2] != (n, s):
            raise InvalidRequest(f"a reading of {n} mechanisms must be of shape {(n, s)} at first, not {value.shape}")
        return value.reshape(n * s, *value.shape[2:]) if n > 1 else value

    def each(self, value: Any, what: str) -> Array:
        """Return a vector as (1, 3), or those of a batch as (n s, 3)."""
        n, s = self.states.shape[:2]
        found = numbers(value, what)
        if len(found) not in (1, n):
            raise InvalidRequest(f"{what} must be one for all, or one for each of {n} mechanisms, not {len(found)}")
        return np.repeat(found, s, axis=0) if len(found) > 1 else found

    def poses(self, order: int = 0) -> tuple[Array, Array]:
        """Return dimensionless rotations (order + 1, n s, b, 3, 3) and translations of bodies."""
        if not order and self._is_compiled and ("poses", 0) not in self._cache:
            self._compute_twists()
        if ("poses", order) not in self._cache:
            curve, y = self.flat()
            self._cache["poses", order] = curve.system.poses(y, self.series(order) if order else None)
        rotation, shift = self._cache["poses", order]
        return rotation, shift

    def body_number(self, body: str) -> int:
        """Return the number of a body."""
        if instance("body", body, str) not in self.curve.system.bodies:
            raise InvalidRequest(f"there is no body {body!r}, only {', '.join(self.curve.system.bodies)}")
        return self.curve.system.bodies.index(body)

    def point(self, body: str, at: Any, order: int = 0) -> Array:
        """Return the path of a body point, (s, 3) or (s, order + 1, 3).

        The point is given in the design pose.
        """
        system, b = self.curve.system, self.body_number(body)
        rotation, shift = self.poses(whole("order", order, 0, MAX_ORDER))
        p = (self.each(at, "a point") - system.centre) / system.unit
        x = (rotation[:, :, b] @ p[..., None])[..., 0] + shift[:, :, b]
        out = self._read(x, system.unit)
        if order:
            out[..., 0, :] += system.centre
        else:
            out += system.centre
        return out

    def direction(self, body: str, vector: Any, order: int = 0) -> Array:
        """Return a direction of a body, (s, 3) or (s, order + 1, 3).

        The direction is given in the design pose.
        """
        rotation, _ = self.poses(whole("order", order, 0, MAX_ORDER))
        v = self.each(vector, "a direction")
        return self._read((rotation[:, :, self.body_number(body)] @ v[..., None])[..., 0], 1.0)

    def rotation(self, body: str) -> Array:
        """Return the rotation of a body from the design pose, shape (s, 3, 3)."""
        return self._split_batch(self.poses()[0][0][:, self.body_number(body)])

    def spin(self, body: str, order: int = 1) -> Array:
        """Return angular velocity, acceleration ... of a body per unit of the drive, shape (s,
        order, 3).
        """
        turn = self.poses(whole("order", order, 1, MAX_ORDER))[0][:, :, self.body_number(body)]
        k = np.arange(1.0, order + 1).reshape(-1, 1, 1, 1)
        w = series(turn[1:] * k, np.swapaxes(turn, -1, -2)[:-1], np.matmul)
        vector = np.stack([w[..., 2, 1], w[..., 0, 2], w[..., 1, 0]], axis=-1)
        unit = self._parameter_series()[1]
        scale = np.array([factorial(j) / unit ** (j + 1) for j in range(order)])
        return self._split_batch(np.moveaxis(vector * scale[:, None, None], 0, 1))

    @property
    def scalars(self) -> tuple[Scalar, ...]:
        """The held scalars, then the driving one: one for each freedom."""
        return (*self.held, *self.others, self.driven)

    def basis(self) -> Array:
        """Return rates (n s, unknowns, f) of unknowns per unit of each of `scalars`."""
        if "basis" not in self._cache:
            self._compute_twists()
        return np.asarray(self._cache["basis"])

    @property
    def stated(self) -> list[tuple[Any, ...]]:
        """Keys that identify each of `scalars`; see `elements.identity`."""
        if "stated" not in self._cache:
            self._cache["stated"] = [identity(s) for s in self.scalars]
        known: list[tuple[Any, ...]] = self._cache["stated"]
        return known

    def function(self, scalar: Scalar) -> tuple[ScalarFunction, HardPoints]:
        """Return a scalar as a function of the poses, and its points."""
        key = identity(scalar)
        if key not in self._cache:
            self._cache[key] = self.mechanism.scalar_function(scalar, self.scalars)
        function, points = self._cache[key]
        return function, points

    def twists(self) -> Array:
        """Return twists (n s, b, 6, f) of bodies per unit of each scalar: velocity, then spin.

        The velocity is that of the centre of the mechanism.
        """
        if "twists" not in self._cache:
            self._compute_twists()
        return np.asarray(self._cache["twists"])

    def _compute_twists(self) -> None:
        """Compute poses and twists of all bodies."""
        curve, y = self.flat()
        if curve.system.fast:
            rotation, shift, basis, twists = compiled.rated(curve.system.fast, curve.held, y)
            self._cache.update({("poses", 0): (rotation[None], shift[None]), "basis": basis, "twists": twists})
            return
        basis = self._cache["basis"] = self.inverse()[:, :, curve.system.rows :]
        screws = np.swapaxes(curve.system.screws(y, *self.poses()), 1, 2)
        carried = [self.carries(b)[:, None] for b in range(len(curve.system.bodies))]
        self._cache["twists"] = np.stack([screws @ (own * basis) for own in carried], axis=1)

    def carries(self, b: int) -> Array:
        """Return whether each unknown moves a body, shape (unknowns,)."""
        system = self.curve.system
        out, bodies = np.zeros(system.unknowns), {whole("b", b, 0, len(system.bodies) - 1)}
        for p in reversed(system.placed):
            for body, on, first in zip(p.bodies, p.on, p.unknown, strict=True):
                if body in bodies:
                    out[first : first + UNKNOWNS[p.joint_kind]] = 1
                    bodies.add(on)
        return out

    def joint(self, body: str, index: int = 0, order: int = 0) -> Array:
        """Return the coordinate of the joint that carries a body, 0 in the design pose; (s,) or (s,
        order + 1).
        """
        system, b = self.curve.system, self.body_number(body)
        index, order = whole("index", index, 0), whole("order", order, 0, MAX_ORDER)
        for p in system.placed:
            if b in p.bodies and not p.guide and index < UNKNOWNS[p.joint_kind] <= 2:
                unit = system.unit if p.joint_kind == PRISMATIC or index else 1.0
                at = p.bodies.index(b)
                y = self.flat()[1]
                x = np.zeros((order + 1, len(y)))
                if order:
                    x[:] = self.series(order)[:, :, p.unknown[at] + index]
                x[0] = y[:, p.number[at] + index]
                return self._read(x, unit)
        raise InvalidRequest(f"{body} hangs on no joint with a coordinate {index}")

    def plot(
        self,
        file: str | Path | None = None,
        wheel: Wheel | Sequence[Wheel] | None = None,
        points: Mapping[str, tuple[str, Any]] | None = None,
        labels: bool = True,
        title: str = "",
        springs: Mapping[str, Length] | None = None,
    ) -> Figure:
        """Draw the mechanism in the pose nearest to the design pose, with ghosts of the ends.

        Parameters
        ----------
        file : path, optional
            PNG, SVG or PDF, chosen by the suffix.
        wheel : Wheel or sequence of Wheel, optional
            Wheels to draw, with the paths of their centres.
        points : dict, optional
            Points with paths to draw: label to body and point in the design pose.
        labels : bool
            Whether to write names, and lengths of links.
        title : str, optional
        springs : dict, optional
            Lengths between two points to draw as coils, by label.

        Raises
        ------
        InvalidRequest
            If the motion is that of a batch, or the file cannot be written.
        MissingExtra
            Without matplotlib.
        """
        from ..drawing.figure import draw
        from .axle import Wheel
        from .picture import scene

        wheels = (wheel,) if isinstance(wheel, Wheel) else several("wheel", wheel or (), Wheel)
        marked = {
            text("a name of points", name): pair("each of points", one, "a body and a point")
            for name, one in (instance("points", points, Mapping | None) or {}).items()
        }
        if len(self.states) != 1:
            raise InvalidRequest("a picture is of one mechanism, not of a batch: sweep `mechanism.one(i)`")
        coils = {
            text("a name of springs", name): instance("each of springs", one, Length)
            for name, one in (instance("springs", springs, Mapping | None) or {}).items()
        }
        seen = scene(self.mechanism, self, wheels, marked, text("title", title), coils)
        return draw(seen, file, switch("labels", labels))

    def plot_curves(self, table: pd.DataFrame, file: str | Path | None = None) -> Figure:
        """Plot columns of a table, one row per pose, over the drive: such as ``kinematics(motion,
        wheel)``.

        Raises
        ------
        InvalidRequest
            If there are more columns than panels of a sheet, or the file cannot be written.
        MissingExtra
            Without matplotlib.
        """
        import pandas as pd

        from ..drawing.curves import plot

        instance("table", table, pd.DataFrame)
        if self.others:
            raise InvalidRequest(f"curves are plotted over one drive, not over {len(self.drives)}: hold the others")
        heading = f"drive [{self.drive_unit}]"
        return plot(self.drive_shown, heading, table.drop(columns=heading, errors="ignore"), file)

    def residual(self) -> Array:
        """Return the largest violation (s,) of any condition, including redundant ones."""
        curve, y = self.flat()
        return self._split_batch(np.abs(curve.system.evaluate(y)[0]).max(1, initial=0) * curve.system.unit)


def _is_regular(square: Array) -> bool:
    return bool((np.linalg.slogdet(square)[0] != 0).all())


def taken(motion: Motion, reading: Callable[[Any], Any], what: str) -> Array:
    """Return a user's reading of a motion as numbers; raise `InvalidRequest` if it fails."""
    if not callable(reading):
        raise InvalidRequest(f"{what} must be a function of a motion, not {quoted(reading)}")
    try:
        found = reading(motion)
    except CatalogueError:
        raise
    except Exception as error:
        raise InvalidRequest(f"{what} fails: {one_line(error)}") from error
    return array(what, found)


def in_time(reduced: Any, rates: Any) -> Array:
    """Return time derivatives for a law q(t) of the drive (Faà di Bruno).

    Parameters
    ----------
    reduced : array-like, shape (..., order + 1)
        A scalar with its derivatives by the drive, order at most 3.
    rates : array-like, shape (order,)
        Velocity, acceleration, jerk of the drive.

    Raises
    ------
    InvalidRequest
        If an argument is no array of numbers, the order is above 3, or rates are missing.
    """
    x, v = array("reduced", reduced, (..., None)), array("rates", rates)
    out = x.copy()
    order = x.shape[-1] - 1
    if order > 3 or v.ndim != 1 or len(v) < order:
        raise InvalidRequest("time derivatives up to the third, with as many rates of the drive")
    if order > 0:
        out[..., 1] = x[..., 1] * v[0]
    if order > 1:
        out[..., 2] = x[..., 2] * v[0] ** 2 + x[..., 1] * v[1]
    if order > 2:
        out[..., 3] = x[..., 3] * v[0] ** 3 + 3 * x[..., 2] * v[0] * v[1] + x[..., 1] * v[2]
    return out
