"""The store as data frames, one row per guide or reach."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import ColumnElement, func, select

from ..kinematics.linkage import SLIDING
from ..kinematics.types import Indices
from ..problem.constraints import Constraints
from ..store import Database, Guide, Mechanism, Reach, joined
from ..store.schema import GUIDES
from .names import SINGULAR, check_kinds, check_names

if TYPE_CHECKING:
    import pandas as pd

#: Columns of a guide that a reach repeats.
_REPEATED = ("kind", "series", "cover")


@dataclass(frozen=True)
class GuideFrames:
    """Stored guides selected by name, order and joints, in one frame or in several.

    Attributes
    ----------
    reaches : bool
        One row per reach of a guide, instead of one per guide.

    Raises
    ------
    InvalidRequest
        If a name is unknown, at construction.
    DatabaseError
        If the file is damaged.
    """

    database: Database
    constraints: Constraints
    kinds: Sequence[str] = ()
    reaches: bool = False

    def __post_init__(self) -> None:
        self.database.check()
        check_names(self.database, self.constraints)
        check_kinds(self.kinds)

    def numbers(self) -> Indices:
        """Return the numbers of the guides, in order."""
        wanted = self._filter(select(Guide.id).join_from(Guide, Mechanism))
        return self.database.read(wanted.order_by(Guide.id))["id"]

    def whole(self) -> pd.DataFrame:
        """Return all selected guides in one frame; see `Catalogue.guides`."""
        return self._frame(self._parameters())

    def parts(self, count: int = 2000) -> Iterator[pd.DataFrame]:
        """Yield one frame or more, of `count` guides each, with the columns of the whole one."""
        names, numbers = self._parameters(), self.numbers()
        for start in range(0, max(len(numbers), 1), count):
            part = numbers[start : start + count].tolist()
            ends = (part[0], part[-1]) if part else (0, 0)
            yield self._frame(names, Guide.id.between(*ends))

    def _filter(self, query: Any, *conditions: ColumnElement[bool]) -> Any:
        query = query.where(*conditions)
        for name, singular in SINGULAR.items():
            if names := getattr(self.constraints, name):
                query = query.where(getattr(Mechanism, singular).in_(names))
        if self.kinds:
            query = query.where(Guide.kind.in_(self.kinds))
        if self.constraints.pins_only:
            query = query.where(Mechanism.family.not_in(SLIDING))
        order = self.constraints.order
        return query.where(Guide.contact_order >= order) if order else query

    def _parameters(self) -> list[str]:
        """Return the names of free parameters, in the order of the guides."""
        each = func.json_each(Mechanism.parameters).table_valued("key", "id")
        query = self._filter(select(each.c.key).join_from(Guide, Mechanism).join(each, onclause=Guide.id > 0))
        first = func.min(Guide.id * 2**20 + each.c.id)  # number of the guide, and position of the parameter in its text
        rows = self.database.read(query.group_by(each.c.key).order_by(first))
        return [str(name) for name in rows["key"]]

    def _frame(self, parameters: Sequence[str], *part: ColumnElement[bool]) -> pd.DataFrame:
        """Read the guides, or the part of them that a condition selects."""
        import pandas as pd

        found = self.database.read(self._filter(GUIDES, *part).order_by(Guide.id))
        texts = found.pop("parameters")
        self.database.pivots(found)
        guides = pd.DataFrame(found)
        read = self.database.objects(texts, numbers=True)
        columns = {f"parameter_{name}": [one.get(name, float("nan")) for one in read] for name in parameters}
        guides = guides.join(pd.DataFrame(columns, index=guides.index, dtype=float))
        if not self.reaches:
            return guides
        own = [column for column in Reach.__table__.columns if column.name not in _REPEATED]
        query = self._filter(joined(*own), *part).order_by(Reach.guide_id, Reach.level.desc())
        rows = self.database.read(query)
        return guides.merge(pd.DataFrame(rows), left_on="id", right_on="guide_id").drop(columns="guide_id")
