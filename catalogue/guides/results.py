"""Results: sequences of guides, best first."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar, overload

from ..markup import element
from .candidate import COLUMNS, Candidate
from .chain_stretch import ChainStretch
from .stretch import Stretch
from .verbs import verb

if TYPE_CHECKING:
    import pandas as pd

    from ..problem.problem import Request


class Printable(Protocol):
    """An answer that can be printed as a row of a table."""

    def to_dict(self) -> dict[str, Any]: ...


T = TypeVar("T", bound=Printable)

#: Number of answers in the repr: a screen.
SHOWN = 12


@dataclass(frozen=True, eq=False, repr=False)
class Results(Sequence[T]):
    """A sequence of answers of one kind, best first; subclasses define the printed `columns`.

    Attributes
    ----------
    candidates : list
    explanation : object
        Its text explains the result; computed when printed.
    """

    candidates: list[T]
    explanation: Any = field(repr=False, default="")

    def __len__(self) -> int:
        return len(self.candidates)

    def __repr__(self) -> str:
        rows = [f"  {i}: {one!r}" for i, one in enumerate(self.candidates[:SHOWN])]
        more = [f"  ... {len(self) - SHOWN} more"] * (len(self) > SHOWN)
        return "\n".join([f"<{type(self).__name__} of {len(self)}>", *rows, *more])

    def _repr_html_(self) -> str:
        """Return animated cards and a table for a notebook; for an empty result its explanation."""
        if not self.candidates:
            return element("pre", self.explain())
        cards: str = verb("cards_html")(self.candidates, self.title)
        return cards

    @property
    def title(self) -> str:
        """Title of the list in a notebook."""
        return f"{type(self).__name__} of {len(self)}"

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> Self: ...
    def __getitem__(self, index: int | slice) -> T | Self:
        if isinstance(index, slice):
            return replace(self, candidates=self.candidates[index])
        return self.candidates[index]

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.candidates == other.candidates

    __hash__ = None  # type: ignore[assignment]  # equality without a hash: a list is inside

    @property
    def columns(self) -> list[str]:
        """Names of the printed fields."""
        raise NotImplementedError

    def to_pandas(self) -> pd.DataFrame:
        """Convert to a data frame, one row per candidate."""
        import pandas as pd

        return pd.DataFrame([c.to_dict() for c in self.candidates], columns=self.columns)

    def to_json(self) -> str:
        """Convert to a JSON list of candidates."""
        return json.dumps([c.to_dict() for c in self.candidates], indent=1, allow_nan=False)

    def remember(self) -> list[str]:
        """Store the candidates and return their codes, for `catalogue.recall` and all commands.

        Returns
        -------
        list of str

        Raises
        ------
        InvalidRequest
            If the file of answers cannot be written.
        """
        from .codes import remember

        return remember(self.candidates)

    def save(self, file: str | Path) -> None:
        """Write the candidates to a JSON file, for `catalogue.load` on any machine.

        Parameters
        ----------
        file : path

        Raises
        ------
        InvalidRequest
            If the file cannot be written.
        """
        from .codes import save

        save(self, file)

    def explain(self) -> str:
        """Explain the result: candidates examined, constraints violated, times.

        For an empty result: which constraints to relax, to which values.
        """
        return str(self.explanation)


@dataclass(frozen=True, eq=False, repr=False)
class Found(Results[Candidate]):
    """Answers to a request, best first.

    Attributes
    ----------
    request : Request or None
        The request that they answer.
    cost : float or None
        Cost of the best answer, which the ranking minimises.

    Examples
    --------
    >>> from catalogue import StraightLine
    >>> found = cat.find(StraightLine(stroke=150, deviation=0.5), limit=3)
    >>> len(found), list(found.to_pandas().columns[:3])
    (3, ['id', 'family', 'series'])
    >>> cat.find(found.request) == found
    True
    """

    request: Request | None = field(repr=False, default=None)
    cost: float | None = field(repr=False, default=None)

    @property
    def columns(self) -> list[str]:
        return list(COLUMNS)


@dataclass(frozen=True, eq=False, repr=False)
class Measured(Results[Any]):
    """Measured stretches, the best of each linkage first.

    Attributes
    ----------
    failed : dict of int to str
        Reason for each linkage without a stretch, by number.

    Examples
    --------
    >>> from catalogue import guide
    >>> watt = guide([[[-50, 30], [0, 30]], [[50, -30], [0, -30]]], (0, 0))
    >>> found = watt.measure(deviation=0.05, limit=1)
    >>> len(found), found.failed
    (1, {})
    """

    failed: Mapping[int, str] | None = None

    @property
    def columns(self) -> list[str]:
        return (type(self.candidates[0]) if self.candidates else Stretch).columns()


@dataclass(frozen=True, eq=False, repr=False)
class Improvement(Results[Candidate]):
    """A linkage before and after its improvement, and the best of the catalogue.

    Attributes
    ----------
    which : list of str
        Role of each existing candidate: ``before``, ``improved``, ``catalogue``.

    Examples
    --------
    >>> from catalogue import StraightLine
    >>> watt = cat.guide("watt").at(100.0)
    >>> found = watt.improve(StraightLine(stroke=100, deviation=0.5), rank_by="size")
    >>> found.which[0], found.before.stroke
    ('before', 100.0)
    """

    which: tuple[str, ...] = ()

    @property
    def before(self) -> Candidate:
        """The given linkage."""
        return self.candidates[0]

    @property
    def improved(self) -> Candidate | None:
        """The improved linkage; None if nothing better was found."""
        return self._by_role("improved")

    @property
    def catalogue(self) -> Candidate | None:
        """The best of the catalogue under the same conditions.

        None if there is none or none was sought.
        """
        return self._by_role("catalogue")

    @property
    def columns(self) -> list[str]:
        return [*Candidate.columns()]

    def _by_role(self, name: str) -> Candidate | None:
        return self.candidates[self.which.index(name)] if name in self.which else None


@dataclass(frozen=True, eq=False, repr=False)
class ChainImprovement(Measured):
    """A stretch of a mechanism of many bars before and after its improvement.

    Attributes
    ----------
    which : tuple of str
        ``before``, ``improved``: the role of each stretch, as far as it exists.
    """

    which: tuple[str, ...] = ()

    @property
    def before(self) -> ChainStretch:
        """The best stretch of the given mechanism."""
        one: ChainStretch = self.candidates[0]
        return one

    @property
    def improved(self) -> ChainStretch | None:
        """The best stretch of the improved mechanism; None if nothing better was found."""
        return self.candidates[1] if len(self.candidates) > 1 else None
