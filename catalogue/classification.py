"""To which series given linkages belong."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np

from .instant import Instant
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
        Whether the linkage belongs to the series: residual at most `TOLERANCE` and margin above it.
    """

    series: str
    family: str
    configuration: str
    residual: float
    margin: float
    holds: bool


@dataclass(frozen=True)
class Memberships(Sequence[Membership]):
    """The series that one linkage belongs to, the nearest first; `near` are all that its family allows."""

    near: tuple[Membership, ...]

    @property
    def holding(self) -> tuple[Membership, ...]:
        """Those that hold."""
        return tuple(m for m in self.near if m.holds)

    @property
    def nearest(self) -> Membership | None:
        """The series with the smallest residual, whether it holds or not."""
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
    family, configuration : ndarray, shape (n,)
    codes : list of str
        Series tested, k of them.
    residual, margin : ndarray, shape (n, k)
        NaN where the family is none of the series', or the instant has no curvature (`reason`).
    reason : ndarray of str, shape (n,)
        What is missing of the instant; see `catalogue.instant.Curvature.reason`.
    """

    family: Array
    configuration: Array
    codes: list[str]
    residual: Array
    margin: Array
    reason: Array

    @property
    def holds(self) -> Array:
        """Which series hold, shape (n, k)."""
        with np.errstate(invalid="ignore"):
            return np.asarray((self.residual <= TOLERANCE) & (self.margin > TOLERANCE))

    def __len__(self) -> int:
        return len(self.family)

    @overload
    def __getitem__(self, index: int) -> Memberships: ...
    @overload
    def __getitem__(self, index: slice) -> list[Memberships]: ...
    def __getitem__(self, index: int | slice) -> Memberships | list[Memberships]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        order = np.argsort(self.residual[index])  # NaN last
        holds = self.holds[index]
        place = sorted(order, key=lambda k: not holds[k])
        return Memberships(
            tuple(
                Membership(
                    self.codes[k],
                    str(self.family[index]),
                    str(self.configuration[index]),
                    float(self.residual[index, k]),
                    float(self.margin[index, k]),
                    bool(holds[k]),
                )
                for k in place
                if np.isfinite(self.residual[index, k])
            )
        )

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


def classify(linkage: Linkage, series: Mapping[str, Series]) -> Classification:
    """Return the memberships of each linkage in the given series.

    Parameters
    ----------
    linkage : Linkage of n
    series : mapping of Series
        By code.  One that raises is left out, with a `PluginWarning`.
    """
    from .plugins import PluginWarning, one_line

    instant = Instant(linkage)
    n, codes = len(linkage), list(series)
    residual, margin = np.full((n, len(codes)), np.nan), np.full((n, len(codes)), np.nan)
    for k, one in enumerate(series.values()):
        try:
            residual[:, k], margin[:, k] = one.classify(instant)
        except Exception as error:  # a plugin may raise anything
            residual[:, k] = margin[:, k] = np.nan
            warnings.warn(f"series {one.code} is left out: {one_line(error)}", PluginWarning, stacklevel=3)
    return Classification(
        linkage.family, instant.configuration, codes, residual, margin, np.asarray(instant.curvature.reason)
    )
