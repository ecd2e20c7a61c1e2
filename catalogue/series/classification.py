"""Find the series to which given linkages belong."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, overload

import numpy as np
import numpy.typing as npt

from ..curvature_theory.guided_elements import GuidedElements, guided_elements
from ..curvature_theory.instant import Instant
from ..curvature_theory.leading_error import path_singularity
from ..errors import InvalidRequest, PluginError, PluginWarning, quoted
from ..given import complexes, number, positive
from ..kinematics.linkage import FAMILIES, Linkage, LinkageLike
from ..kinematics.types import Array, Floats, Integers, Mask, Texts
from .membership import Membership, Memberships
from .series import Series

if TYPE_CHECKING:
    import pandas as pd

#: Residual up to which a linkage whose pivots are rounded to double precision belongs to a series.
TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class Classification(Sequence[Memberships]):
    """Memberships of n linkages in k `tested` series, from residual and margin, (n, k).

    Both are NaN for series of other families, or without curvature (`reason`).  A linkage is a
    member if the residual is at most the tolerance and the margin above it.  This leaves gaps:
    close to a series, where its residual is just above the tolerance and the margin of a
    surrounding series just below it, and where rays count as parallel (up to 1e-8 rad) or
    coincident (up to 1e-7).  There the linkage belongs to the series of least residual; of several
    within the tolerance, to the one of largest margin.
    """

    instant: Instant
    tested: list[Series]
    residual: Floats
    margin: Floats
    tolerance: float = TOLERANCE

    def __repr__(self) -> str:
        return f"<Classification of {self.instant.linkage!r} in {len(self.tested)} series>"

    def _repr_html_(self) -> str:
        """Return the series of each linkage, or the nearest one, as a table for a notebook."""
        from ..html_table import MOST, html_table

        rows = []
        for k, family in enumerate(self.family[:MOST].tolist()):
            one = self[k]
            near = one.nearest
            nearest = [near.series, f"{near.residual:.2g}"] if near else [None, None]
            rows.append([k, family, self.configuration[k], ", ".join(one.series) or None, *nearest])
        return html_table([">", "family", "configuration", "series", "nearest", ">residual"], rows, len(self))

    @property
    def family(self) -> Texts:
        """Family of each linkage, shape (n,)."""
        return self.instant.linkage.family

    @property
    def configuration(self) -> Texts:
        """Configuration of each linkage, shape (n,).

        See `catalogue.curvature_theory.configuration.configuration`.
        """
        return self.instant.configuration

    @property
    def reason(self) -> Array:
        """Reason for missing curvature of each instant, shape (n,).

        See `catalogue.curvature_theory.analysis.Curvature.reason`.
        """
        return np.asarray(self.instant.curvature.reason)

    @cached_property
    def holds(self) -> Mask:
        """Whether series hold, shape (n, k): at least one wherever a series has a residual."""
        with np.errstate(invalid="ignore"):
            found = np.asarray((self.residual <= self.tolerance) & (self.margin > self.tolerance))
        gap = np.flatnonzero(~found.any(1) & np.isfinite(self.residual).any(1))
        if gap.size:
            residual = np.where(np.isfinite(self.residual[gap]), self.residual[gap], np.inf)
            order = np.lexsort((-np.nan_to_num(self.margin[gap]), np.maximum(residual, self.tolerance)), axis=1)
            found[gap, order[:, 0]] = True
        return found

    @cached_property
    def ranking(self) -> Integers:
        """Numbers of the series, the nearest first as in `Memberships`, shape (n, k).

        -1 where there is no residual.
        """
        names = self.family
        dimension = np.array([[one.dimension(name) for one in self.tested] for name in FAMILIES])
        row = np.array([list(FAMILIES).index(name) for name in names.tolist()], dtype=int)
        around = np.broadcast_to([not one.degenerate for one in self.tested], self.residual.shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = self.residual / np.clip(np.nan_to_num(self.margin), 0, 1)
        third = np.where(self.holds, dimension[row].reshape(part.shape), part)
        absent = ~np.isfinite(self.residual)
        order = np.lexsort((third, ~self.holds, around, absent), axis=1)
        return np.where(np.take_along_axis(absent, order, 1), -1, order)

    def __len__(self) -> int:
        return len(self.instant)

    @overload
    def __getitem__(self, index: int) -> Memberships: ...
    @overload
    def __getitem__(self, index: slice) -> list[Memberships]: ...
    def __getitem__(self, index: int | slice) -> Memberships | list[Memberships]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        family, configuration = str(self.family[index]), str(self.configuration[index])
        residual, margin, holds = (a[index].tolist() for a in (self.residual, self.margin, self.holds))
        return Memberships(
            tuple(
                Membership(self.tested[k].code, family, configuration, residual[k], margin[k], holds[k])
                for k in self.ranking[index].tolist()
                if k >= 0
            )
        )

    def guided(self, radius: float | None = None) -> GuidedElements:
        """Find the guided elements of the linkages; with a radius [length] circling points too."""
        return guided_elements(self.instant, None if radius is None else positive("radius", radius))

    def singularity(self, point: npt.ArrayLike) -> tuple[Array, Array]:
        """Count the coincident cusps and inflections of coupler paths; see `path_singularity`.

        Parameters
        ----------
        point : complex array_like, shape () or (n,)
            Coupler points in the reference position [length].

        Raises
        ------
        InvalidRequest
            If a coordinate is NaN or infinite.
        """
        z = complexes("point", point)
        if z.shape not in ((), (len(self),)):
            raise InvalidRequest(f"point must be x + iy, or {len(self)} of them, not {quoted(point)}")
        return path_singularity(self.instant.linkage, z, pole=self.instant.pole)

    def to_pandas(self) -> pd.DataFrame:
        """Return a row per linkage: tags, nearest series, residual, margin, all that hold."""
        import pandas as pd

        codes = np.array([one.code for one in self.tested] + [None], dtype=object)
        first = self.ranking[:, :1]
        kinds, kind = np.unique(
            np.where(self.holds[np.arange(len(self))[:, None], self.ranking], self.ranking, -1),
            axis=0,
            return_inverse=True,
        )
        names = np.array([", ".join(codes[k] for k in row if k >= 0) for row in kinds], dtype=object)
        residual, margin = (
            np.where(first >= 0, np.take_along_axis(a, first, 1), np.nan)[:, 0] for a in (self.residual, self.margin)
        )
        return pd.DataFrame(
            {
                "family": self.family,
                "configuration": self.configuration,
                "series": names[kind.ravel()],
                "nearest": codes[first[:, 0]],
                "residual": residual,
                "margin": margin,
            }
        )


def classify(linkage: LinkageLike, series: Mapping[str, Series], tolerance: float | None = None) -> Classification:
    """Return the memberships of each linkage in the given series.

    Parameters
    ----------
    linkage : Linkage of n, its pivots, or a mapping of link lengths
        See `Linkage` and `catalogue.kinematics.from_lengths`.
    series : mapping of Series
        Series by code. A series whose formulas raise is left out, with a `PluginWarning`.
    tolerance : float, optional
        Residual up to which a series holds, if its margin is larger: the effect of the rounding of
        the pivots. Default: `TOLERANCE`.

    Raises
    ------
    InvalidLinkage
        If the pivots or lengths make no linkage.
    InvalidRequest
        If the tolerance is not in [0, 1).
    """
    instant = Instant(Linkage.of(linkage))
    tolerance = TOLERANCE if tolerance is None else number("the tolerance", tolerance)
    if not 0 <= tolerance < 1:
        raise InvalidRequest(f"the tolerance must be a residual from 0 up to 1, not {tolerance}")
    tested = list(series.values())
    residual, margin = (np.full((len(instant.linkage), len(tested)), np.nan) for _ in range(2))
    for k, one in enumerate(tested):
        try:
            residual[:, k], margin[:, k] = one.residuals(instant)
        except PluginError as error:
            warnings.warn(one.left_out(error), PluginWarning, stacklevel=3)
    return Classification(instant, tested, residual, margin, tolerance)
