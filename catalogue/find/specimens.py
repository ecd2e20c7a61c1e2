"""Search a collection: filter and rank by stored numbers, verify on the finite motion."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from sqlalchemy import ColumnElement, Float, and_, case, func, or_, select, true

from ..collections.bounds import bounds, with_constraints
from ..collections.goal import Bound, Goal
from ..collections.results import CollectionCandidate
from ..collections.spec import COLUMNS, Collection, Measured
from ..errors import InvalidRequest, PluginError, quoted
from ..foreign_code import checked_text, foreign
from ..given import names, positive, whole
from ..given import number as a_number
from ..guides.chain_stretch import ChainStretch
from ..guides.results import Found, Results
from ..kinematics.types import Complexes, Floats
from ..problem.constraints import REGIONS, Constraints
from ..problem.criteria import ANSWERS
from ..problem.path import CircularArc, PathRequest, StraightLine
from ..store import Database
from ..store import SpecimenRow as Row
from ..units import converted, factor, unit_or_none
from .chain_regions import Image, Regions
from .near_specimens import near_specimens


class Verification(NamedTuple):
    """Options of the verification of stored specimens."""

    batch: int = 32  #: number of specimens verified at once
    batches: int = 32  #: largest number of batches, per unit of effort
    #: Deviation from a given circle per difference of stroke over radius from that of the best
    #: circle [strokes]: about 1/16 with free ends; smaller here, so that no answer is filtered out
    #: before it is measured.
    per_sweep: float = 1 / 40
    same_radius: float = 1e-9  #: relative difference of two radii within rounding
    seeds: int = 4  #: number of four-bars from which mechanisms of more bars are refined
    slack: float = 1e-3  #: relative difference permitted between stored and measured deviation


VERIFY = Verification()


@dataclass(frozen=True, eq=False)
class CollectionResults(Results[CollectionCandidate]):
    """Answers of a collection to a request, best first."""

    collection: Collection = field(kw_only=True)

    @property
    def title(self) -> str:
        return f"{self.collection.title}: {len(self)}"

    @property
    def columns(self) -> list[str]:
        return [*COLUMNS[:-1], *self.collection.metrics, COLUMNS[-1]]


def find_in(
    database: Database,
    collection: Collection,
    request: PathRequest,
    *,
    limit: int,
    rank_by: str,
    families: Sequence[str],
    series: Sequence[str],
    where: Mapping[str, Any] | None,
    special: Sequence[str],
    refine: bool | None,
    effort: int = 1,
    drawn: Callable[[], None],
    find: Callable[..., Found],
    **constraints: Any,
) -> CollectionResults:
    """Search a collection; see `catalogue.Catalogue.find_in`.

    `drawn` is called once the request is valid, before the store is read; `find` finds the
    four-bars that some collections are made of.
    """
    limit, effort, clock = whole("limit", limit, 1), whole("effort", effort, 1), time.perf_counter()
    criteria = ["deviation", *collection.metrics]
    if not isinstance(rank_by, str) or rank_by not in criteria:
        raise InvalidRequest(f"cannot rank by {quoted(rank_by)}; {collection.name} has {', '.join(criteria)}")
    if request.is_wide:
        raise InvalidRequest("collections are searched for arcs below a half circle: ask for an angle below 160\u00b0")
    if _is_placed(request) and collection.mechanism is None:
        raise InvalidRequest(
            f"{collection.name} lays its paths from the origin along +x: leave out start, direction and end of the path"
        )
    wanted, regions = Constraints.of(constraints), Regions.of(request, constraints)
    if regions is not None and collection.mechanism is None:
        raise InvalidRequest(f"{collection.name} has no planar mechanisms of many bars: leave out regions")
    if isinstance(where, Mapping) or where is None:  # `bounds` refuses others
        where = with_constraints(collection.name, collection.metrics, where or {}, wanted)
    given = bounds(collection.name, collection.metrics, request.stroke, where)
    if wanted.pins_only:
        families = _pinned_families(collection, names("families", families))
    named = {
        "family": (names("families", families), collection.families),
        "series": (names("series", series), collection.series),
        "special": (names("special", special), [*collection.special]),
    }
    allowed = {what: wanted for what, (wanted, _) in named.items()}
    for what, (_, held) in named.items():
        if unknown := [name for name in allowed[what] if name not in held]:
            raise InvalidRequest(f"there is no {what} {unknown[0]!r}; there are {', '.join(held) or 'none'}")
    drawn()
    tests = _tests(collection, request, given, allowed)
    search = _Search(database, collection, request, given, tests, allowed, regions, effort)
    more = rank_by != "deviation" and collection.metrics[rank_by].more
    # Stored numbers decide which specimens are verified, measured ones their order; the sort is
    # stable.

    def key(c: CollectionCandidate) -> float:
        return c.deviation if rank_by == "deviation" else c.metrics[rank_by]

    def suits(one: CollectionCandidate, other: CollectionCandidate) -> bool:
        return key(one) > key(other) if more else key(one) < key(other)

    order = _stored(rank_by).desc() if more else _stored(rank_by).asc()
    found = sorted([*search.run(limit, order), *search.made(find, limit)], key=key, reverse=more)[:limit]
    if collection.refine is not None and (collection.near and len(found) < limit if refine is None else refine):
        goal = Goal(rank_by, given, None if regions is None else regions.outside)
        better = [(one, of) for one, of in search.refined(found, goal, find) if of < 0 or suits(one, found[of])]
        replaced, search.moved = {of for _, of in better}, len(better)
        found = [*(one for one, _ in better), *(c for i, c in enumerate(found) if i not in replaced)]
    found = sorted(found, key=key, reverse=more)[:limit]
    search.seconds, search.shown = time.perf_counter() - clock, len(found)
    return CollectionResults(found, search, collection=collection)


def _pinned_families(collection: Collection, families: Sequence[str]) -> list[str]:
    """Select the requested families that have pins only."""
    if collection.pinned is None:
        raise InvalidRequest(f"pins_only does not go with {collection.name}: the kinds of its joints are not known")
    found = [name for name in collection.families if name in collection.pinned and (not families or name in families)]
    if not found:
        which = f"none of {', '.join(families)}" if families else f"no family of {collection.name}"
        raise InvalidRequest(f"{which} has pins only: leave out pins_only")
    return found


def _is_placed(request: PathRequest) -> bool:
    return any(request.start) or bool(request.along)


def stretch_of(one: CollectionCandidate) -> ChainStretch:
    """Convert an answer to a stretch of a mechanism of many bars.

    Raises
    ------
    InvalidRequest
        If the collection has no planar mechanisms of many bars.
    """
    if one.collection.mechanism is None:
        raise InvalidRequest(
            f"an answer of {one.collection.name} is no planar mechanism of many bars: it can be shown, not measured"
        )
    with collection_errors(one.collection, "read as a mechanism"):
        given, window = one.collection.mechanism(one)
    return ChainStretch.of_answer(one, given, window)


def specimen(database: Database, collection: Collection, id: int, stroke: float) -> CollectionCandidate:
    """Read a stored specimen and place it along a path; see `catalogue.Catalogue.specimen`."""
    id, stroke = whole("id", id, 1), positive("stroke", stroke)
    of = and_(Row.collection == collection.name, Row.id == id)
    rows = database.read(select(Row.kind, Row.parameters).where(of))
    if not len(rows["kind"]):
        raise InvalidRequest(f"{collection.name} has no specimen {id}; `find --collection` lists ids")
    nominal = StraightLine if rows["kind"][0] == "line" else CircularArc
    [found] = measured(collection, database.objects(rows["parameters"]), nominal(stroke, deviation=0.1 * stroke))
    if found.reason:
        raise InvalidRequest(f"specimen {id} of {collection.name} cannot be laid there: {found.reason}")
    return _candidate(collection, id, stroke, found)


def in_unit(one: CollectionCandidate, unit: str | None) -> CollectionCandidate:
    """Convert an answer to another unit and measure it again.

    An unknown unit is taken to be this one.

    Raises
    ------
    InvalidRequest
        If the unit is unknown, or the mechanism cannot be measured.
    """
    if unit_or_none(unit) is None or unit == one.unit:
        return one
    if one.unit is None:
        return replace(one, unit=unit)
    times = factor(one.unit, str(unit))
    stroke, radius, start = converted([one.stroke, one.radius, [*one.start]], times)
    [found] = measured(one.collection, [one.parameters], _request(stroke, radius, unit))
    if found.reason:
        raise InvalidRequest(found.reason)
    made = _candidate(one.collection, one.id, stroke, found, unit)
    return replace(made, start=tuple(start), along=one.along, reverse=one.reverse, over=one.over)


def _request(stroke: float, radius: float | None, unit: str | None = None) -> PathRequest:
    """Return the path of an answer as a request, with a tolerance that it meets."""
    if radius is None:
        return StraightLine(stroke, 0.1 * stroke, unit=unit)
    return CircularArc(stroke, 0.1 * stroke, radius, unit=unit)


def checked(one: CollectionCandidate) -> CollectionCandidate:
    """Refuse an answer that disagrees with its measurement; add metrics missing in its record."""
    stroke, _ = positive("stroke", one.stroke), whole("id", one.id, 0)
    try:
        [found] = measured(one.collection, [one.parameters], _request(stroke, one.radius))
        again = one if found.reason else _candidate(one.collection, one.id, stroke, found)
    except PluginError as error:  # invalid parameters
        raise InvalidRequest(str(error)) from None
    told, numbers = ({"deviation": c.deviation, **c.metrics} for c in (one, again))
    tags, known = ((c.family, c.series, c.configuration, c.special) for c in (one, again))
    wrong = [
        k
        for k, v in numbers.items()
        if k in told and not abs(a_number(k, told[k]) - v) <= 2 * VERIFY.slack * abs(v) + 1e-9 * stroke
    ]
    if found.reason or tags != known or not {"deviation", *told} <= numbers.keys() or wrong:
        what = f"its {wrong[0]} is {told[wrong[0]]:g}, measured again {numbers[wrong[0]]:g}" if wrong else found.reason
        raise InvalidRequest(what or f"it is {known}, not {tags}")
    return replace(one, metrics={**again.metrics, **one.metrics})


@contextmanager
def collection_errors(collection: Collection, what: str) -> Iterator[None]:
    """Run a function of a collection; errors then name the collection and its file."""
    try:
        with foreign(f"collection {collection.name}"):
            yield
    except PluginError as error:
        raise PluginError(f"collection {collection.name} cannot be {what}: {error} ({collection.origin})") from error


def measured(collection: Collection, stored: Sequence[Any], request: PathRequest) -> list[Measured]:
    """Measure mechanisms, given by their parameters, on their finite motion."""
    with collection_errors(collection, "measured"):
        found = list(collection.measure(deepcopy(stored), request))
        for one in found:
            collection.measures(one)
        if len(found) != len(stored):
            raise PluginError(f"{len(found)} of {len(stored)} mechanisms were measured")
    return found


def _candidate(
    collection: Collection, number: int, stroke: float, m: Measured, unit: str | None = None
) -> CollectionCandidate:
    """Build the answer from a measured mechanism."""
    with collection_errors(collection, "classified"):
        tags = collection.classify(deepcopy(m.parameters))
        for tag in (tags.family, tags.series, tags.configuration, *tags.special):
            checked_text("a tag", tag, 100)
    metrics = {name: float(m.metrics[name]) for name in collection.metrics}
    return CollectionCandidate(
        number,
        collection,
        tags.family,
        tags.series,
        tags.configuration,
        tuple(tags.special),
        stroke,
        float(m.deviation),
        m.radius,
        metrics,
        m.parameters,
        unit,
    )


def _stored(name: str) -> ColumnElement[float]:
    """Return the stored column of the deviation or of a metric."""
    return Row.deviation.expression if name == "deviation" else func.json_extract(Row.metrics, f"$.{name}")


def _tests(
    collection: Collection, request: PathRequest, given: list[Bound], allowed: dict[str, tuple[str, ...]]
) -> dict[str, ColumnElement[bool]]:
    """Return the conditions on stored specimens by name."""
    tests: dict[str, ColumnElement[bool]] = {
        f"deviation {request.deviation:g}": Row.deviation <= request.relative * (1 + VERIFY.slack)
    }
    tests |= {what: getattr(Row, what).in_(allowed[what]) for what in ("family", "series") if allowed[what]}
    if patterns := [pattern for name in allowed["special"] for pattern in collection.special[name]]:
        tests[f"special {' or '.join(allowed['special'])}"] = or_(
            *(Row.configuration.op("GLOB")(pattern) for pattern in patterns)
        )
    if request.sweep is not None and "sweep" in collection.metrics:
        reach = request.relative / VERIFY.per_sweep
        tests[f"radius {request.radius:g}"] = _stored("sweep").between(request.sweep - reach, request.sweep + reach)
    for b in given:
        low, high = b.low / b.scale, b.high / b.scale
        slack = VERIFY.slack * max(abs(v) for v in (low, high) if abs(v) < float("inf")) if str(b) else 0.0
        tests[str(b)] = _stored(b.name).between(max(low - slack, -1e300), min(high + slack, 1e300))
    return tests


@dataclass
class _Search:
    """A search with counts of its specimens; its text is the explanation."""

    database: Database
    collection: Collection
    request: PathRequest
    bounds: list[Bound]
    tests: dict[str, ColumnElement[bool]]  #: conditions on stored specimens by name
    #: permitted families, series and special cases; any if empty
    allowed: Mapping[str, Sequence[str]] = field(default_factory=dict)
    regions: Regions | None = None
    effort: int = 1
    not_special: int = 0  #: number of specimens that are none of the special cases
    verified: int = 0
    shown: int = 0
    from_guides: int = 0  #: number of verified specimens that were made of planar guides
    moved: int = 0  #: number of refined answers
    refinements: int = 0  #: number of specimens moved towards the request
    #: number of measured specimens that failed each test
    removed: Counter[str] = field(default_factory=Counter)
    #: excess and value of the closest miss of each test
    nearest: dict[str, tuple[float, float]] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def special(self) -> Sequence[str]:
        """Permitted special cases; any if empty."""
        return self.allowed.get("special", ())

    @property
    def held(self) -> ColumnElement[bool]:
        """Condition for specimens of the collection with this kind of path."""
        return and_(Row.collection == self.collection.name, Row.kind == self.request.kind)

    @property
    def permitted(self) -> ColumnElement[bool]:
        """Condition for those of the permitted families and series."""
        return and_(self.held, *(self.tests[name] for name in ("family", "series") if name in self.tests))

    def run(self, limit: int, order: ColumnElement[float]) -> Iterator[CollectionCandidate]:
        """Yield answers in stored order, verified in batches, until there are enough."""
        ranked = (
            select(Row.id, Row.parameters)
            .where(self.held, *self.tests.values())
            .order_by(order, Row.deviation, Row.family, Row.block, Row.id)
            .limit(VERIFY.batch)
        )
        found = 0
        for part in count() if self.special else range(VERIFY.batches * self.effort):
            rows = self.database.read(ranked.offset(VERIFY.batch * part))
            stored = [*self.database.objects(rows["parameters"])]
            wanted = [i for i, one in enumerate(stored) if self.is_special(one)]
            measured = self.measured([stored[i] for i in wanted])
            for number, one in zip(rows["id"][wanted].tolist(), measured, strict=True):
                if self.serves(one):
                    found += 1
                    yield self.candidate(number, one)
            if not stored or found >= limit:
                return

    def made(self, find: Callable[..., Found], limit: int) -> Iterator[CollectionCandidate]:
        """Yield answers made from planar guides, if the collection supports this."""
        if self.collection.starts is None or self.special:
            return
        transmission = max([b.low for b in self.bounds if b.name == "min_transmission" and b.low > 0], default=0.0)
        how = {"limit": max(limit, ANSWERS), "cognates": True}
        guides = self.four_bars(find, **how, min_transmission=transmission)
        if guides is None:  # the messages of other searches tell what to relax
            guides = self.four_bars(find, **how)
        if guides is None:
            return
        with collection_errors(self.collection, "made of four-bars"):
            stored = list(self.collection.starts(*guides, self.request))
        self.from_guides += len(stored)
        for one in self.measured(stored):
            if self.serves(one):
                made = self.candidate(0, one)
                if self.is_allowed(made):
                    yield made

    def is_special(self, parameters: Any) -> bool:
        """Tell whether a specimen is one of the requested special cases; count the others."""
        if not self.special:
            return True
        with collection_errors(self.collection, "classified"):
            good = not set(self.special).isdisjoint(self.collection.classify(deepcopy(parameters)).special)
        self.not_special += not good
        return good

    def measured(self, stored: list[Any]) -> list[Measured]:
        """Measure a batch of specimens on their finite motion."""
        found = measured(self.collection, stored, self.request) if stored else []
        self.verified += len(found)
        return found

    def four_bars(self, find: Callable[..., Found], **how: Any) -> tuple[Floats, Complexes] | None:
        """Find four-bars; return their pivots and guided points, None without any."""
        found = find(self.request, families=["four-bar"], **how)
        if not len(found):
            return None
        return np.array([one.pivots for one in found]), np.array([complex(*one.guided) for one in found], complex)

    def seeds(self, find: Callable[..., Found]) -> list[Any]:
        """Return mechanisms made of four-bars within the bounds, as starts of refinement."""
        if self.collection.seeds is None:
            return []
        size = min([b.high for b in self.bounds if b.name == "size"], default=math.inf)
        angle = max([b.low for b in self.bounds if b.name == "min_transmission"], default=0.0)
        how: dict[str, Any] = {"limit": VERIFY.seeds, "rank_by": "deviation", "effort": 0}
        how |= {"max_size": size} if math.isfinite(size) else {}
        guides = self.four_bars(find, **how, min_transmission=max(angle, 0.0))
        if guides is None:
            return []
        with collection_errors(self.collection, "made of four-bars"):
            return list(self.collection.seeds(*guides, self.request))

    def refined(
        self, found: list[CollectionCandidate], goal: Goal, find: Callable[..., Found]
    ) -> list[tuple[CollectionCandidate, int]]:
        """Refine answers and stored specimens near the request.

        Return the refined answers, each with the number of the answer from which it was refined, -1
        for a stored specimen.
        """
        refine, known = self.collection.refine, {c.id for c in found if c.id}
        assert refine is not None  # checked by the caller
        starts = [(c.id, c.parameters, i) for i, c in enumerate(found)]
        near = near_specimens(
            self.database, self.collection, self.permitted, self.request, goal, self.collection.near * self.effort
        )
        starts += [(number, one, -1) for number, one in near if number not in known and self.is_special(one)]
        starts += [(0, one, -1) for one in self.seeds(find) if self.is_special(one)]
        if not starts:
            return []
        with collection_errors(self.collection, "refined"):
            moved = list(refine([deepcopy(one) for _, one, _ in starts], self.request, goal))
            if len(moved) != len(starts):
                raise PluginError(f"{len(moved)} of {len(starts)} mechanisms were refined")
        some = [(*start, one) for start, one in zip(starts, moved, strict=True) if one is not None]
        self.refinements += len(some)
        out = list[tuple[CollectionCandidate, int]]()
        for (number, _, of, _), one in zip(some, self.measured([one for *_, one in some]), strict=True):
            if self.serves(one):
                made = self.candidate(number, one)
                if self.is_allowed(made) and (of < 0 or {*found[of].special} <= {*made.special}):
                    out.append((made, of))
        return out

    def is_allowed(self, one: CollectionCandidate) -> bool:
        """Tell whether family, series and special case of an answer are permitted."""
        tags = {"family": one.family, "series": one.series}
        special = not self.special or not set(self.special).isdisjoint(one.special)
        return special and all(not self.allowed[name] or tag in self.allowed[name] for name, tag in tags.items())

    def serves(self, one: Measured) -> bool:
        """Tell whether a measured specimen is an answer.

        Count the others by the first failed test.
        """
        failed = self._failed_tests(one)
        if not failed:
            return True
        test, excess, value = failed[0]
        self.removed[test] += 1
        if len(failed) == 1 and math.isfinite(value):  # relaxing this one test would suffice
            self.nearest[test] = min((excess, value), self.nearest.get(test, (excess, value)))
        return False

    def _failed_tests(self, one: Measured) -> list[tuple[str, float, float]]:
        """List the tests that a specimen fails, with its excess and value; NaN if unknown."""
        if one.reason:
            return [(one.reason, 0.0, math.nan)]
        failed = list[tuple[str, float, float]]()
        if not self.on_radius(one.radius):
            value = math.nan if one.radius is None else one.radius
            failed.append((f"radius {self.request.radius:g}", abs(value - (self.request.radius or 0.0)), value))
        if not one.deviation <= self.request.deviation:
            failed.append(
                (f"deviation {self.request.deviation:g}", one.deviation - self.request.deviation, one.deviation)
            )
        for bound in self.bounds:
            value = one.metrics[bound.name]
            if not bound.holds(value):
                failed.append((str(bound), max(bound.low - value, value - bound.high), value))
        out = {} if (image := self.best_image(one)) is None else image.excess
        return failed + [(name, amount, amount) for name, amount in out.items() if amount]

    def best_image(self, one: Measured) -> Image | None:
        """Return the mirror image of a specimen that fits the regions best, if any."""
        return None if self.regions is None or one.places is None else self.regions.best_image(one.places)

    def on_radius(self, radius: float | None) -> bool:
        """Tell whether a deviation was measured from an arc of the requested radius, if any."""
        wanted = self.request.radius
        if self.request.kind == "line" or wanted is None:
            return True
        return radius is not None and abs(radius - wanted) <= VERIFY.same_radius * wanted

    def candidate(self, number: int, m: Measured) -> CollectionCandidate:
        """Build the answer from a measured specimen."""
        made = _candidate(self.collection, number, float(self.request.stroke), m, self.request.unit)
        x, y = self.request.start
        made = replace(made, start=(float(x), float(y)), along=float(self.request.along))
        image = self.best_image(m)
        return made if image is None else replace(made, reverse=image.reverse, over=image.over)

    def __str__(self) -> str:
        """Explain the search: specimens excluded by each bound, verified, and the closest miss."""
        columns: list[Any] = [func.count().label("all")]
        for i, name in enumerate(self.tests):
            others = and_(true(), *(t for n, t in self.tests.items() if n != name))
            columns.append(func.coalesce(func.sum(case((self.tests[name], 0), else_=1)), 0).label(f"excluded {i}"))
            columns.append(func.coalesce(func.sum(case((others, 1), else_=0)), 0).label(f"freed {i}"))
        number = {k: int(v[0]) for k, v in self.database.read(select(*columns).where(self.held)).items()}
        excluded = {name: number[f"excluded {i}"] for i, name in enumerate(self.tests)}
        useful = {name: n for i, (name, n) in enumerate(excluded.items()) if n and number[f"freed {i}"]}
        lines = [f"{self.collection.name}: {number['all']} specimens guide a point along a {self.request.kind}"]
        lines += [f"  {name} alone excludes {n} of them" for name, n in excluded.items()]
        lines += [f"  {self.not_special} that might be are not {' or '.join(self.special)}"] if self.not_special else []
        told = f", {self.from_guides} more made of four-bars that answer the request" if self.from_guides else ""
        followed = self.verified - self.from_guides - self.refinements
        lines.append(f"  {followed} of the rest were followed on their finite motion{told}; {self.shown} are shown")
        if self.refinements:
            lines.append(f"  {self.refinements} were moved towards the request; {self.moved} of them answer it better")
        lines += [f"  there {name} removed {n}" for name, n in self.removed.items()]
        if not self.shown:
            lines.append("no piece found: " + self._advice(number["all"], useful))
        return "\n".join([*lines, f"in {1000 * self.seconds:.0f} ms"])

    def _relaxed_bound(self, test: str) -> float:
        """Return a bound, rounded, that admits the specimen nearest to passing a test."""
        from .explain import rounded

        value = self.nearest[test][1]
        bound = next((b for b in self.bounds if str(b) == test), None)
        return rounded(value, 0.0, up=bound is None or value > bound.high) or value

    def _advice(self, held: int, useful: dict[str, int]) -> str:
        """Advise which bound to relax.

        `useful` counts the specimens that each decisive test excludes.
        """
        name = self.collection.name
        if self.verified:
            [(worst, failed)] = self.removed.most_common(1)
            told = "is out by" if worst in (*REGIONS, "keep_out") else "has"
            near = f"; the nearest {told} {self._relaxed_bound(worst):g}" if worst in self.nearest else ""
            return f"relax {worst}, which {failed} of {self.verified} failed on the finite motion{near}"
        if not held:
            return f"{name} holds nothing of this kind; run `catalogue build --collection {name}`"
        if not useful:
            return f"{' and '.join(self.tests)} exclude one another; relax more than one of them"
        best = max(useful, key=lambda name: useful[name])
        bound = next((b for b in self.bounds if str(b) == best), None)
        near = ""
        if bound is not None or best.startswith("deviation"):
            value = _stored("deviation" if bound is None else bound.name)
            scale = self.request.stroke if bound is None else bound.scale
            others = [test for name, test in self.tests.items() if name != best]
            ends = (make(value, type_=Float).label(name) for make, name in ((func.min, "least"), (func.max, "most")))
            seen = select(*ends).where(self.held, *others)
            least, most = (scale * float(end[0]) for end in self.database.read(seen).values())
            near = f"; the nearest has {most if bound is not None and most < bound.low else least:.4g}"
        return f"relax {best}, which alone excludes {useful[best]} stored specimens{near}"
