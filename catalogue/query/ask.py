"""From a request to candidates: looked up in the database, or made where pivots are given."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..errors import InvalidRequest
from ..store import Database
from .constraints import Constraints
from .explain import explain, explain_constructed
from .find import answer
from .found import Found, candidates
from .names import check_names
from .ranking import Ranking
from .request import Request, path_request, positive, whole
from .trail import Trail

if TYPE_CHECKING:
    from ..series import Series


def ask(
    database: Database,
    series: Callable[[], Mapping[str, Series]],
    request: Request,
    wanted: Constraints,
    *,
    limit: int,
    rank_by: str | Mapping[str, float] | Sequence[str],
    per_series: int | None,
    distinct: float,
    effort: int,
    refine: bool,
    cognates: bool,
    round_to: float | None,
) -> Found:
    """Return the candidates; see `catalogue.Catalogue.find`.

    Parameters
    ----------
    series : callable
        Returns the series that are registered, by code.  Called only where pivots are given, or when somebody asks how
        far a candidate has drifted.
    """
    request = path_request("find", request)
    limit, effort = whole("limit", limit, 1), whole("effort", effort, 1)
    ranking = Ranking.of(rank_by, per_series, distinct, limit)
    step = None if round_to is None else positive("round_to", round_to)
    if wanted.given:
        if cognates or step is not None:
            raise InvalidRequest(
                "cognates and round_to move the pivots: they cannot be asked for where pivots are given"
            )
        return _constructed(series(), request, wanted, ranking, limit=limit, effort=effort)
    check_names(database, wanted)
    trail = Trail()
    found = answer(
        database, request, wanted, ranking,
        limit=limit, effort=effort, trail=trail, refine=refine, cognates=cognates, round_to=step,
    )  # fmt: skip
    listed = []
    if found is not None:
        from ..refine.drift import Drifts

        listed = candidates(found, request, wanted.play, Drifts(found, series, wanted.slots) if refine else None)
    return Found(listed, lambda: explain(database, request, wanted, trail, len(listed)))


def _constructed(
    series: Mapping[str, Series], request: Request, wanted: Constraints, ranking: Ranking, **how: Any
) -> Found:
    """Return guides with the given pivots, made in closed form and refined: the database is not asked."""
    from .construct import constructed

    trail = Trail()
    found = constructed(series, request, wanted, ranking, trail=trail, **how)
    listed = candidates(found, request, wanted.play) if found is not None else []
    return Found(listed, lambda: explain_constructed(request, wanted, trail, len(listed)))
