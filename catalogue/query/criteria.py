"""What answers can be ranked by."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InvalidRequest
from .request import positive

#: What candidates can be ranked by; each is made a number of order 1 of which less is better.  The balance is the size
#: over the stroke less the transmission angle over 90 degrees, the score that of `catalogue.query.ranking.score`.
CRITERIA = ("balance", "size", "deviation", "transmission", "max_link", "max_ground", "max_arm", "score")
#: How far from each other answers are as designs unless asked otherwise: refinement leads neighbours to one.
DISTINCT = 0.02


def weights(rank_by: str | Mapping[str, float]) -> dict[str, float]:
    """Return criteria with weights from ``"size"``, ``"size=1,transmission=0.5"`` or a mapping.

    Raises
    ------
    InvalidRequest
        If a criterion is unknown or a weight is not positive.
    """
    if isinstance(rank_by, str):
        parts = [part.partition("=") for part in rank_by.split(",")]
        given: Mapping[str, Any] = {name.strip(): value if equal else 1.0 for name, equal, value in parts}
    elif isinstance(rank_by, Mapping):
        given = rank_by
    else:
        raise InvalidRequest(f"cannot rank by {rank_by!r}; choose from {', '.join(CRITERIA)}")
    unknown = [name for name in given if name not in CRITERIA]
    if unknown or not given:
        raise InvalidRequest(
            f"cannot rank by {unknown[0] if unknown else 'nothing'}; choose from {', '.join(CRITERIA)}"
        )
    return {name: positive(f"the weight of {name}", weight) for name, weight in given.items()}
