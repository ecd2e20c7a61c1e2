"""To which series given linkages belong."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np
import numpy.typing as npt

from .errors import InvalidRequest
from .instant import Elements, Instant, elements, path_singularity
from .linkage import Array, Linkage
from .series import Series

if TYPE_CHECKING:
    import pandas as pd

#: Residual up to which a linkage whose pivots are rounded to double precision belongs to a series.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Membership:
    """One series against one linkage.

    Attributes
    ----------
    series, family, configuration : str
    residual : float
        Dimensionless distance from the series, 0 on it.
    margin : float
        Dimensionless distance from where the series meets another one; a residual beside a small margin decides little.
    holds : bool
        Whether the linkage belongs to the series: residual at most the tolerance and margin above it.
    """

    series: str
    family: str
    configuration: str
    residual: float
    margin: float
    holds: bool


@dataclass(frozen=True)
class Memberships(Sequence[Membership]):
    """The series that one linkage belongs to, the nearest first; `near` are all that its family allows.

    Degenerate series come before `general` and `parallel`, which surround them; among those, the ones that hold before
    the others, of several that hold the one with the fewest free parameters, of the others the one whose residual is
    the smallest part of its margin (counted up to 1): beside a linkage near two series that meet there are always some
    of either, with a small residual and a margin that is not much larger.
    """

    near: tuple[Membership, ...]

    @property
    def holding(self) -> tuple[Membership, ...]:
        """Those that hold."""
        return tuple(m for m in self.near if m.holds)

    @property
    def nearest(self) -> Membership | None:
        """The first series of `near`, whether it holds or not."""
        return self.near[0] if self.near else None

    @property
    def series(self) -> list[str]:
        """Codes of the series that hold."""
        return [m.series for m in self.holding]

    def __len__(self) -> int:
        return len(self.holding)

    def __iter__(self) -> Iterator[Membership]:
        return iter(self.holding)

    @overload
    def __getitem__(self, index: int) -> Membership: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Membership, ...]: ...
    def __getitem__(self, index: int | slice) -> Membership | tuple[Membership, ...]:
        return self.holding[index]


@dataclass(frozen=True, eq=False)
class Classification(Sequence[Memberships]):
    """Memberships of n linkages.

    Attributes
    ----------
    instant : Instant of n
        The linkages.
    tested : list of Series
        Those tested, k of them.
    residual, margin : ndarray, shape (n, k)
        NaN where the family is none of the series', or the instant has no curvature (`reason`).
    tolerance : float
        Residual up to which a series holds.
    """

    instant: Instant
    tested: list[Series]
    residual: Array
    margin: Array
    tolerance: float = TOLERANCE

    @property
    def family(self) -> Array:
        """Family of each linkage, shape (n,)."""
        return self.instant.linkage.family

    @property
    def configuration(self) -> Array:
        """Configuration of each linkage, shape (n,); see `catalogue.instant.configuration`."""
        return self.instant.configuration

    @property
    def reason(self) -> Array:
        """What is missing of each instant, shape (n,); see `catalogue.instant.Curvature.reason`."""
        return np.asarray(self.instant.curvature.reason)

    @property
    def holds(self) -> Array:
        """Which series hold, shape (n, k)."""
        with np.errstate(invalid="ignore"):
            return np.asarray((self.residual <= self.tolerance) & (self.margin > self.tolerance))

    def __len__(self) -> int:
        return len(self.family)

    @overload
    def __getitem__(self, index: int) -> Memberships: ...
    @overload
    def __getitem__(self, index: slice) -> list[Memberships]: ...
    def __getitem__(self, index: int | slice) -> Memberships | list[Memberships]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        family, residual, holds = str(self.family[index]), self.residual[index], self.holds[index]

        def place(k: int) -> tuple[bool, bool, float]:
            one = self.tested[k]
            return not one.degenerate, not holds[k], one.dimension(family) if holds[k] else part[k]

        with np.errstate(divide="ignore", invalid="ignore"):
            part = residual / np.clip(np.nan_to_num(self.margin[index]), 0, 1)

        return Memberships(
            tuple(
                Membership(
                    self.tested[k].code,
                    family,
                    str(self.configuration[index]),
                    float(residual[k]),
                    float(self.margin[index, k]),
                    bool(holds[k]),
                )
                for k in sorted(np.flatnonzero(np.isfinite(residual)).tolist(), key=place)
            )
        )

    def guided(self, radius: float | None = None) -> Elements:
        """Return what the linkages guide, and with which order; given a radius [length], circling points too."""
        return elements(self.instant, radius)

    def singularity(self, point: npt.ArrayLike) -> tuple[Array, Array]:
        """Return how many cusps and inflections coincide in the paths of coupler points: see `path_singularity`.

        Parameters
        ----------
        point : complex or array_like of complex, shape (n,)
            In the reference position.

        Raises
        ------
        InvalidRequest
            If a coordinate is NaN or infinite.
        """
        z = np.asarray(point, dtype=complex)
        if not np.isfinite(z).all():
            raise InvalidRequest("the point of which the singularity is asked must have finite coordinates")
        return path_singularity(self.instant.linkage, z, pole=self.instant.pole)

    def to_pandas(self) -> pd.DataFrame:
        """Return one row per linkage: family, configuration, nearest series, its residual and margin, all that hold."""
        import pandas as pd

        rows = []
        for one in self:
            first = one.nearest
            rows.append(
                {
                    "series": ", ".join(one.series),
                    "nearest": first.series if first else None,
                    "residual": first.residual if first else np.nan,
                    "margin": first.margin if first else np.nan,
                }
            )
        frame = pd.DataFrame(rows, columns=["series", "nearest", "residual", "margin"])
        frame.insert(0, "configuration", self.configuration)
        frame.insert(0, "family", self.family)
        return frame


def classify(linkage: Linkage, series: Mapping[str, Series], tolerance: float = TOLERANCE) -> Classification:
    """Return the memberships of each linkage in the given series.

    Parameters
    ----------
    linkage : Linkage of n
    series : mapping of Series
        By code.  One that raises is left out, with a `PluginWarning`.
    tolerance : float
        Residual up to which a series holds, if its margin is larger: what the rounding of the pivots makes of zero.

    Raises
    ------
    InvalidRequest
        If the tolerance is not in [0, 1).
    """
    from .plugins import PluginWarning, one_line

    instant = Instant(linkage)
    if not 0 <= tolerance < 1:
        raise InvalidRequest(f"the tolerance must be a residual from 0 up to 1, not {tolerance}")
    tested = list(series.values())
    residual, margin = (np.full((len(linkage), len(tested)), np.nan) for _ in range(2))
    for k, one in enumerate(tested):
        try:
            residual[:, k], margin[:, k] = one.classify(instant)
        except Exception as error:  # a plugin may raise anything
            residual[:, k] = margin[:, k] = np.nan
            warnings.warn(f"series {one.code} is left out: {one_line(error)}", PluginWarning, stacklevel=3)
    return Classification(instant, tested, residual, margin, tolerance)
