"""Read a stored guide, or a named one as published with the best of its series."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from sqlalchemy import func, select

from ..candidates.batch import CandidateBatch, Origin, on_path
from ..candidates.stored import as_stored, linkages
from ..errors import DatabaseError, InvalidRequest, quoted, shortened
from ..given import LARGEST, positive, whole
from ..guidance.kinds import RETURNS, SLOTS
from ..guidance.reach import LEVELS
from ..guides.candidate import Candidate, known
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array
from ..problem.constraints import Constraints
from ..problem.path import CircularArc, PathRequest, StraightLine
from ..problem.problem import Problem
from ..problem.ranking import Ranking
from ..quantities import MEASURES, QUANTITIES
from ..series.named_guides import NamedGuide, is_named
from ..store import COLUMNS, Batch, Database, Guide, Mechanism, Reach, joined
from .find import Selection
from .listing import candidates

if TYPE_CHECKING:
    from .opened import Opened


class StoredAgreement(NamedTuple):
    """Permitted differences between stored and measured numbers."""

    exact: float = 1e-14  #: deviation up to which a guide is exact [strokes]: rounding
    agree: float = 0.05  #: permitted relative difference: the grids differ
    rounding: float = 1e-11  #: permitted absolute difference of lengths [strokes]


STORED = StoredAgreement()

#: Columns of the reaches of a guide.
SHOWN = (
    *("level", "stroke", "deviation", "sweep"),
    *(row.name for row in QUANTITIES if row.stored is not None and row.source == MEASURES),
)


@dataclass(frozen=True, eq=False)
class StoredGuide:
    """A guide in its canonical frame: pole at the origin, rho0 or height of crank 1 = 1."""

    id: int
    name: str | None  #: name of a named design
    family: str
    series: str
    member: str
    configuration: str
    kind: str
    label: str
    order: int  #: order of contact; 99 if exact
    #: number of coincident inflections at the design position; for a design, of inflections over
    #: its stroke
    inflections: int
    parameters: dict[str, float]  #: free parameters of the member
    linkage: Linkage  #: one linkage; for a slot its inversion, which guides the fixed point of the slot
    point: complex  #: guided point
    curvature: float  #: curvature of the nominal, positive to the left of the tangent; 0 for a line
    rho0: float | None  #: diameter of the inflection circle; None, like the next three, if the pole is at infinity
    kappa: float | None
    kappa_star: float | None
    s: float | None
    provenance: dict[str, Any]  #: plugin, version, plan, seed and block; empty for a named design
    #: Values by level: stroke (canonical); deviation, size, links and arm over the stroke;
    #: transmission angle [deg].
    reaches: dict[str, Array]
    rows: dict[int, dict[str, Array]] = field(repr=False)

    @property
    def is_slot(self) -> bool:
        """Whether a slot in the coupler is guided over a fixed point."""
        return self.kind in SLOTS.values()

    @property
    def returns(self) -> bool:
        """Whether the point travels to the pole and back along one line or circle."""
        return self.kind in RETURNS.values()

    def at(self, stroke: float, level: int | None = None, *, unit: str | None = None) -> Candidate:
        """Place the guide along a path, with its point offset for the reach of a level.

        Parameters
        ----------
        stroke : float
            Stroke, or chord of an arc [length].
        level : int, optional
            Decimal exponent of deviation over stroke; default: the middle one of the stored levels.
        unit : str, optional
            Unit of the lengths.

        Returns
        -------
        Candidate

        Raises
        ------
        InvalidRequest
            If the guide has no reach of that level.
        DatabaseError
            If its measured deviation or size differs from the stored one.
        """
        levels = sorted(self.rows)
        if level is None:
            level = levels[len(levels) // 2]
        if whole("level", level, -99) not in self.rows:
            known = ", ".join(str(k) for k in levels)
            raise InvalidRequest(f"guide {self.id} has no reach of level {level}; it has {known}")
        row = self.rows[level]
        stroke = positive("stroke", stroke)
        request: PathRequest = StraightLine(stroke, 0.1 * stroke, unit=unit)
        if self.curvature:
            request = CircularArc(stroke, 0.1 * stroke, unit=unit)

        def placed(problem: Problem) -> CandidateBatch:
            found = as_stored(problem, row)
            for name, value in (("deviation", found.deviation), ("size", found.measures.size)):
                if not (
                    np.abs(value - row[name]) <= STORED.rounding + STORED.agree * np.maximum(value, row[name])
                ).all():
                    raise DatabaseError(
                        f"guide {self.id} measured again has another {name} than is stored: ask for another one, or, "
                        "if the file was changed, build it anew"
                    )
            return found

        return place_one(request, placed)


def place_one(request: PathRequest, place: Callable[[Problem], CandidateBatch]) -> Candidate:
    """Return the guide that `place` places along the path of a request."""
    problem = Problem.of(request, Constraints(), Ranking())
    return candidates(problem, request, Selection(place(problem), np.zeros(1, int)))[0]


def stored(database: Database, name: int | str) -> StoredGuide:
    """Read a guide by its id, or the first guide of a named design; see `Catalogue.guide`."""
    database.check()
    if not isinstance(name, str | int) or isinstance(name, bool):
        raise InvalidRequest(f"a guide has a number or a name, not {quoted(name)}")
    try:
        test = Guide.id == min(max(int(name), 0), LARGEST)
    except ValueError:
        test = Mechanism.name == name
    # a named design belongs to no batch
    extra = (
        Guide.curvature,
        Guide.inflections,
        Mechanism.name,
        Mechanism.parameters,
        Mechanism.rho0,
        Mechanism.kappa,
        Mechanism.kappa_star,
        Mechanism.s,
        Batch.plugin,
        Batch.plugin_version,
        Batch.plan,
        func.coalesce(Batch.seed, 0).label("seed"),
        func.coalesce(Batch.number, 0).label("number"),
    )
    every = joined(*COLUMNS, *extra).outerjoin(Batch, Batch.id == Mechanism.batch_id)
    found = database.read(every.where(test).order_by(Guide.id, Reach.level))
    if not len(found["id"]):
        raise InvalidRequest(
            f"the database holds no guide {shortened(str(name), 60)}; {_similar_name(database, str(name))}"
        )
    found = {k: v[found["id"] == found["id"][0]] for k, v in found.items()}
    one = {k: v[0].item() if isinstance(v[0], np.generic) else v[0] for k, v in found.items()}
    same = ("id", "name", "family", "series", "member", "configuration", "kind", "label", "inflections", "curvature")
    batch = ("plugin", "plugin_version", "plan", "seed", "number")
    curvature: dict[str, Any] = {k: known(one[k]) for k in ("rho0", "kappa", "kappa_star", "s")}
    return StoredGuide(
        **{k: one[k] for k in same},
        **curvature,
        order=one["contact_order"],
        parameters=database.objects([one["parameters"]], numbers=True)[0],
        linkage=linkages(database.pivots(found)[:1], found["kind"][:1]),
        point=complex(one["x"], one["y"]),
        provenance={k: one[k] for k in batch} if one["plugin"] is not None else {},
        reaches={k: found[k] for k in SHOWN},
        rows={
            int(level): {k: found[k][i : i + 1] for k in found}
            for i, level in enumerate(found["level"])
            if level in LEVELS
        },
    )


def _similar_name(database: Database, name: str) -> str:
    """Suggest a similar name for one missing in the database."""
    if is_named(name):
        return "`catalogue build` adds the named guides"
    held = [str(n) for n in database.read(select(Mechanism.name).where(Mechanism.batch_id.is_(None)))["name"] if n]
    near = get_close_matches(name.lower(), held, n=5) or [n for n in held if name.lower() in n]
    if near:
        return f"near names are {', '.join(near)}"
    return "`catalogue find` lists guides with their ids"


def as_published(design: NamedGuide, guide: StoredGuide, stroke: float = 1.0, *, unit: str | None = None) -> Candidate:
    """Place a named design as published over its usual stroke, from (0, 0) to (stroke, 0)."""
    stroke = positive("stroke", stroke)
    tags = (guide.id, guide.family, guide.series, guide.configuration, guide.order, 0)
    traced = design.traced
    request: PathRequest = StraightLine(stroke, 0.09 * stroke, unit=unit)
    if design.circle:
        request = CircularArc(stroke, 0.09 * stroke, unit=unit)
    origin = Origin(*(np.array([tag]) for tag in tags))
    return place_one(request, lambda problem: on_path(problem, origin, design.guide, traced))


def best_of_series(catalogue: Opened, published: Candidate) -> Candidate | None:
    """Return the straightest guide of the series of a design, over its stroke and no larger.

    The guide is stored or synthesised, not refined, which would take seconds.  None if there is
    none, or if the design is exact.
    """
    if published.deviation <= STORED.exact * published.stroke:
        return None
    size = published.size * (1 + 1e-9)
    found = catalogue.find(
        published.request,
        series=[published.series],
        max_size=size,
        rank_by="deviation",
        limit=1,
        per_series=0,
        refine=False,
    )
    return found[0] if found and found[0].deviation < published.deviation else None
