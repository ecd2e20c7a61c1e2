"""The store as a data frame, one row per guide or reach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..kinematics.linkage import SLIDING
from ..problem.constraints import Constraints
from ..store import Database, Guide, Mechanism, Reach, joined
from ..store.schema import GUIDES
from .names import SINGULAR, check_kinds, check_names

if TYPE_CHECKING:
    import pandas as pd

#: Columns of a guide that a reach repeats.
_REPEATED = ("kind", "series", "cover")


def guides_frame(
    database: Database, constraints: Constraints, kinds: Sequence[str] = (), *, reaches: bool = False
) -> pd.DataFrame:
    """Return stored guides selected by name, order and joints; see `Catalogue.guides`."""
    import pandas as pd

    database.check()
    check_names(database, constraints)
    check_kinds(kinds)

    def wanted(query: Any) -> Any:
        for name, singular in SINGULAR.items():
            if names := getattr(constraints, name):
                query = query.where(getattr(Mechanism, singular).in_(names))
        if kinds:
            query = query.where(Guide.kind.in_(kinds))
        if constraints.pins_only:
            query = query.where(Mechanism.family.not_in(SLIDING))
        return query.where(Guide.contact_order >= constraints.order) if constraints.order else query

    found = database.read(wanted(GUIDES).order_by(Guide.id))
    texts = found.pop("parameters")
    database.pivots(found)
    guides = pd.DataFrame(found)
    parameters = pd.DataFrame(database.objects(texts, numbers=True), index=guides.index)
    guides = guides.join(parameters.astype(float).add_prefix("parameter_"))
    if not reaches:
        return guides
    own = [column for column in Reach.__table__.columns if column.name not in _REPEATED]
    rows = database.read(wanted(joined(*own)).order_by(Reach.guide_id, Reach.level.desc()))
    return guides.merge(pd.DataFrame(rows), left_on="id", right_on="guide_id").drop(columns="guide_id")
