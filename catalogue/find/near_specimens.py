"""The stored specimens of a collection nearest to a request, from which refinement starts."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from sqlalchemy import ColumnElement, Float, func, select, type_coerce

from ..collections.goal import Goal
from ..collections.spec import Collection
from ..kinematics.types import Floats
from ..problem.path import PathRequest
from ..store import Database
from ..store import SpecimenRow as Row


class Nearness(NamedTuple):
    """Weights of the excesses of specimens over a request [strokes, right angles]."""

    deviation: float = 0.03  #: weight of the logarithm of the deviation, which refinement reduces most
    angle: float = 1 / 90  #: weight of a degree
    rank: float = 0.1  #: weight of the ranked measure, relative to the bounds


NEARNESS = Nearness()


def near_specimens(
    database: Database, collection: Collection, held: ColumnElement[bool], request: PathRequest, goal: Goal, count: int
) -> list[tuple[int, Any]]:
    """Return the nearest specimens of each family, at most `count`, as ids with their parameters.

    `held` selects the permitted specimens of the collection.
    """
    if not count:
        return []
    names = dict.fromkeys([*(bound.name for bound in goal.bounds), goal.rank_by, "sweep"])
    columns = [
        type_coerce(func.json_extract(Row.metrics, f"$.{name}"), Float).label(name)
        for name in names
        if name in collection.metrics
    ]
    rows = database.read(select(Row.id, Row.family, Row.deviation, *columns).where(held))
    away = NEARNESS.deviation * np.log(np.maximum(rows["deviation"], 1e-300))
    for bound in goal.bounds:
        value = rows[bound.name]
        beyond = np.maximum(bound.low / bound.scale - value, value - bound.high / bound.scale)
        away = away + _weighted(collection, bound.name, np.maximum(beyond, 0.0))
    if goal.rank_by != "deviation":
        sign = -1.0 if collection.metrics[goal.rank_by].more else 1.0
        away = away + NEARNESS.rank * sign * _weighted(collection, goal.rank_by, rows[goal.rank_by])
    if request.sweep is not None and "sweep" in collection.metrics:
        away = away + np.abs(rows["sweep"] - request.sweep)
    chosen = list[int]()
    for family in collection.families:
        here = np.flatnonzero(rows["family"] == family)
        chosen += rows["id"][here[np.argsort(away[here], kind="stable")[:count]]].tolist()
    found = database.read(select(Row.id, Row.parameters).where(Row.id.in_(chosen)))
    return list(zip(found["id"].tolist(), database.objects(found["parameters"]), strict=True))


def _weighted(collection: Collection, name: str, amount: Floats) -> Floats:
    return amount * (NEARNESS.angle if collection.metrics[name].unit == "deg" else 1.0)
