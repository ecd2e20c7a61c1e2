"""Interface of a kind of guides to the optimiser: linear models, moves, cost and violation."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol, Self, TypeVar

from ..kinematics.types import Floats, Indices, Mask

if TYPE_CHECKING:
    from .subproblem import Subproblem


class Judged(NamedTuple):
    """Cost and violation of n guides; arrays of shape (n,)."""

    cost: Floats  #: cost by the ranking
    violation: Floats  #: sum of the violations of the constraints
    met: Mask  #: whether all constraints are met


class Batch(Protocol):
    """n guides, indexed and replaced by their numbers."""

    def __len__(self) -> int: ...

    def __getitem__(self, index: Indices, /) -> Self: ...

    def replaced(self, where: Indices, by: Self, /) -> Self: ...


Guides = TypeVar("Guides", bound=Batch)


class Model(Protocol[Guides]):
    """Interface of a kind of guides to the optimiser."""

    def judged(self, guides: Guides) -> Judged:
        """Return cost and violation as measured on the finite motion."""

    def refinable(self, guides: Guides, met: Mask) -> Mask:
        """Tell which guides can be improved, shape (n,); `met` tells which are feasible."""

    def deviation(self, guides: Guides) -> Floats:
        """Return deviations over tolerances, shape (n,)."""

    def linearised(self, guides: Guides) -> Subproblem:
        """Return the linear problem at guides."""

    def moved(self, guides: Guides, step: Floats) -> tuple[Guides, Indices]:
        """Return guides after steps (n, p), measured, and the numbers of those that are valid."""

    def charted(self, guides: Guides) -> Guides:
        """Choose charts of the motion anew; called after some rounds."""
