"""Parse the arguments of a sweep: drives, their values, held scalars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InvalidRequest, quoted
from ...given import array, number, several
from ...kinematics.types import Array
from .elements import Scalar, identity, title

#: Largest number of poses of a grid: their arrays are in memory.
MAX_POSES = 1_000_000


@dataclass(frozen=True)
class Drives:
    """Driving scalars with their values, and held scalars, of a sweep.

    Attributes
    ----------
    scalars : tuple of scalars
    values : tuple of ndarray, each (s,)
        In the unit of the points, or radians.
    held : tuple of scalars
    at : tuple of float
        Values at which they are held; NaN: the value in the design pose.
    """

    scalars: tuple[Scalar, ...]
    values: tuple[Array, ...]
    held: tuple[Scalar, ...]
    at: tuple[float, ...]

    @staticmethod
    def read(drive: Any, values: Any, hold: Any) -> Drives:
        """Parse the arguments of `Mechanism.sweep`; raise InvalidRequest if they are no drives."""
        if isinstance(drive, Mapping):
            if values is not None:
                raise InvalidRequest("values of several drives stand in their mapping: leave `values` out")
            given = dict(drive)
        elif values is None:
            raise InvalidRequest("a drive needs values: sweep(drive, values), or sweep({drive: values, ...})")
        else:
            given = {drive: values} if isinstance(drive, Scalar) else {}
            several("drives", [drive], Scalar)
        if not given:
            raise InvalidRequest("a sweep needs a drive")
        scalars = several("drives", given, Scalar)
        read = tuple(np.atleast_1d(array("values of a drive", one, (), (None,), finite=True)) for one in given.values())
        if isinstance(hold, Mapping):
            held = several("hold", hold, Scalar)
            at = tuple(np.nan if v is None else number(f"value of {title(s)}", v) for s, v in hold.items())
            if np.isinf(at).any():
                raise InvalidRequest("values of `hold` must be finite")
        else:
            held = several("hold", hold, Scalar)
            at = (np.nan,) * len(held)
        names = [identity(s) for s in (*scalars, *held)]
        if len(set(names)) < len(names):
            twice = next(s for k, s in enumerate((*scalars, *held)) if names[k] in names[:k])
            raise InvalidRequest(f"{title(twice)} is named twice among drives and what is held")
        return Drives(scalars, read, held, at)

    @property
    def one(self) -> bool:
        """Whether one scalar drives, and all others keep their design values."""
        return len(self.scalars) == 1 and bool(np.isnan(self.at).all())

    def path(self) -> Array:
        """Return the values of the drives along their path, (p, d)."""
        lengths = {len(v) for v in self.values} - {1}
        if len(lengths) > 1:
            raise InvalidRequest(
                f"drives of a path have as many values each, not {quoted([len(v) for v in self.values])}: "
                "or ask for their grid"
            )
        return np.stack(np.broadcast_arrays(*self.values), axis=1)

    def grid(self) -> Array:
        """Return the values of the drives over their grid, the last one fastest, (p, d)."""
        if np.prod([float(len(v)) for v in self.values]) > MAX_POSES:
            raise InvalidRequest(f"a grid has at most {MAX_POSES} poses")
        return np.stack([v.ravel() for v in np.meshgrid(*self.values, indexing="ij")], axis=1)
