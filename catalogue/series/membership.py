"""The series to which one linkage belongs or is near."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload


@dataclass(frozen=True)
class Membership:
    """Relation of one linkage to one series.

    Attributes
    ----------
    residual, margin : float
        Dimensionless distance from the series, 0 on it; distance from the place where the series
        meets another one. A residual is of little meaning if the margin is small.
    holds : bool
        Whether the linkage belongs to the series: residual at most the tolerance and margin above
        it.
    """

    series: str
    family: str
    configuration: str
    residual: float
    margin: float
    holds: bool


@dataclass(frozen=True)
class Memberships(Sequence[Membership]):
    """The series that one linkage belongs to, the nearest first.

    `near` holds all series of its family. Degenerate series come before `general` and `parallel`,
    which surround them. Among degenerate ones the series that hold come first, by number of free
    parameters; the others follow by the ratio of residual to margin (at most 1). The ratio is used
    because both series have small residuals near their intersection, with margins not much larger.
    """

    near: tuple[Membership, ...]

    @property
    def holding(self) -> tuple[Membership, ...]:
        """Memberships that hold."""
        return tuple(m for m in self.near if m.holds)

    @property
    def nearest(self) -> Membership | None:
        """The first series of `near`, whether it holds or not."""
        return self.near[0] if self.near else None

    @property
    def series(self) -> list[str]:
        """Codes of the series to which the linkage belongs."""
        return [m.series for m in self.holding]

    def __len__(self) -> int:
        return len(self.holding)

    @overload
    def __getitem__(self, index: int) -> Membership: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Membership, ...]: ...
    def __getitem__(self, index: int | slice) -> Membership | tuple[Membership, ...]:
        return self.holding[index]

    def _repr_html_(self) -> str:
        """Return the series that hold and the near ones as a table for a notebook."""
        from ..html_table import html_table

        rows = [
            (m.series, m.family, m.configuration, f"{m.residual:.2g}", f"{m.margin:.2g}", "✓" if m.holds else "")
            for m in self.near
        ]
        return html_table(["series", "family", "configuration", ">residual", ">margin", "belongs"], rows)
