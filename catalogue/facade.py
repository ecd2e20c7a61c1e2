"""The catalogue as a user holds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from .closing import Closing
from .problem.constraints import Constraints
from .problem.criteria import DISTINCT
from .store import Database, get_setting

if TYPE_CHECKING:
    import numpy.typing as npt

    from .build import Progress
    from .classification import Classification
    from .collections.results import Collected
    from .find.dwell_results import Dwellings, StandStill
    from .find.results import Found
    from .find.stored import StoredGuide
    from .linkage import Linkage
    from .plugins import Registry
    from .problem.request import Request


class Catalogue(Closing):
    """A database of guides with what can be asked of it; made by `catalogue.open`.

    Attributes
    ----------
    database : Database
    """

    def __init__(self, database: Database, plugins: Sequence[str] = ()) -> None:
        self.database = database
        self._folders = tuple(plugins)

    @cached_property
    def registry(self) -> Registry:
        """The plugins, loaded when first needed: a `find` needs none."""
        from .plugins import Registry

        return Registry(self._folders)

    @property
    def complete(self) -> bool:
        """Whether the last build ran to its end."""
        return get_setting(self.database, "complete") == "yes"

    def find(
        self,
        request: Request,
        *,
        limit: int = 12,
        rank_by: str | Mapping[str, float] | Sequence[str] = "score",
        per_series: int | None = None,
        distinct: float = DISTINCT,
        effort: int = 1,
        refine: bool = True,
        cognates: bool = False,
        round_to: float | None = None,
        desires: Mapping[str, Sequence[float]] | None = None,
        **constraints: Any,
    ) -> Found:
        """Return the best guides for a request, each verified on its finite motion at the stroke asked for.

        Parameters
        ----------
        request : StraightLine or CircularArc
        limit : int
            How many at most.
        rank_by : str, mapping or sequence of str
            One of `catalogue.problem.criteria.CRITERIA`, or several with weights: ``"size=1,transmission=0.5"``.  A
            sequence, ``["size", "deviation"]``, weighs nothing: the Pareto front of these criteria comes first, spread
            over all of it, then the second front; `Candidate.front` says which.
        per_series : int, optional
            At most so many of one series as long as there are others; a third of the limit if not given (no bound
            for a front), 0: no bound.
        distinct : float
            No two answers are nearer to each other than this, 0 to 1; of such only the best is given.  About the part
            of the stroke by which a pivot near the path is moved; see `catalogue.candidates.similarity` and
            `Candidate.nearest`.
        effort : int
            How hard to search: starts, rounds of refinement and the points that may be measured grow with it.
        refine : bool
            Move the pivots until what is ranked is best, subject to the deviation and all constraints;
            `Candidate.gap` says what could still be gained nearby.  Else stored guides are given as they are.
        cognates : bool
            Offer the cognates of four-bars and slider-cranks too: the same path, other pivots; see `Candidate.cognate`.
        round_to : float, optional
            Make the lengths of links, and the place of the guided point in the coupler, multiples of this; see
            `Candidate.lengths`.
        desires : mapping of str to (best, worst) or (best, worst, weight), optional
            What makes the score: a size, transmission angle, allowance or shortest link (``min_link``) is desired fully
            from `best` on and not at all from `worst` on; lengths in the user's unit.
        **constraints
            See `catalogue.problem.constraints.Constraints`.

        Raises
        ------
        InvalidRequest
            If the request, a constraint or a name is impossible.
        DatabaseError
            If the database cannot be read.
        """
        from .find.find import find

        return find(
            self.database, lambda: self.registry.series, request, Constraints.of(constraints),
            limit=limit, rank_by=rank_by, per_series=per_series, distinct=distinct, effort=effort, refine=refine,
            cognates=cognates, round_to=round_to, desires=desires,
        )  # fmt: skip

    def find_dwells(self, request: StandStill, *, limit: int = 12, effort: int = 1, **constraints: Any) -> Dwellings:
        """Return crank-driven linkages with a dyad whose rocker stands still, the best transmission angle first, and a
        third of them of one series at most while there are others.

        Parameters
        ----------
        request : StandStill
        limit : int
            How many at most.
        effort : int
            How many stored arcs of each series are looked at, 150 per unit.
        **constraints
            families, series, configurations, order, pins_only and min_transmission of
            `catalogue.problem.constraints.Constraints`.

        Raises
        ------
        InvalidRequest
            If the request, a constraint or a name is impossible.
        DatabaseError
            If the database cannot be read.
        """
        from .find.dwells import find_dwells

        return find_dwells(self.database, request, Constraints.of(constraints), limit=limit, effort=effort)

    def find_in(
        self,
        name: str,
        request: Request,
        *,
        limit: int = 12,
        rank_by: str = "deviation",
        families: Sequence[str] = (),
        series: Sequence[str] = (),
        where: Mapping[str, tuple[float | None, float | None]] | None = None,
        quiet: bool = False,
    ) -> Collected:
        """Return the best pieces of a collection, each verified on its finite motion at the stroke asked for.

        The specimens of the collection are drawn on first use, or when a newer plugin draws them otherwise, with a
        progress bar unless `quiet`.

        Parameters
        ----------
        name : str
            Of the collection; `Registry.collections` has them all.
        request : StraightLine or CircularArc
        limit : int
            How many at most.
        rank_by : str
            ``deviation``, or one of the collection's metrics, best first.
        families, series : sequence of str
            Allowed ones; all if empty.
        where : mapping of str to (least, most)
            Bounds on metrics, None for an open side: ``{"condition": (None, 50.0)}``.

        Raises
        ------
        InvalidRequest
            If the request, a bound or a name is impossible.
        PluginError
            If there is no such collection, or it breaks its contract.
        DatabaseError
            If the database cannot be read or written.
        """
        from .build.collect import is_current
        from .collections.find import find_in
        from .problem.request import path_request

        request = path_request("find_in", request)
        collection = self.registry.collection(name)
        if not is_current(self.database, collection, self.registry.provider(name).version):
            from .progress import shown

            with shown(quiet=quiet, label=f"drawing {name}") as report:
                self.build_collection(name, report=report)
        return find_in(
            self.database,
            collection,
            request,
            limit=limit,
            rank_by=rank_by,
            families=families,
            series=series,
            where=where,
        )

    def build_collection(
        self,
        name: str,
        *,
        count: int | None = None,
        seed: int | None = None,
        report: Callable[[Progress], None] = lambda _: None,
    ) -> Progress:
        """Draw the specimens of a collection up to a number; see `catalogue.build.collect.collect`."""
        from .build.collect import collect

        collection = self.registry.collection(name)
        version = self.registry.provider(name).version
        return collect(self.database, collection, version, count=count, seed=seed, report=report)

    def guide(self, name: int | str) -> StoredGuide:
        """Return a stored guide by its id, or the first guide of a named design.

        Raises
        ------
        InvalidRequest
            If there is none.
        """
        from .find.stored import stored

        return stored(self.database, name)

    def classify(self, linkage: Linkage | npt.ArrayLike, *, tolerance: float | None = None) -> Classification:
        """Return the memberships of given linkages in all series that are registered; see `catalogue.classify`."""
        from .classification import classify

        return classify(linkage, self.registry.series, tolerance)

    def build(
        self,
        *,
        count: int | None = None,
        series: Sequence[str] = (),
        seed: int | None = None,
        processes: int | None = None,
        report: Callable[[Progress], None] = lambda _: None,
    ) -> Progress:
        """Fill the database up to `count` guides, or finish the build that was begun; see `catalogue.build.fill`."""
        from .build import fill
        from .build.fill import COUNT

        begun = {key: get_setting(self.database, key) or "" for key in ("count", "seed", "series")}
        if count is None and not series and not self.complete:  # finish what was begun
            series = [code for code in begun["series"].split() if code in self.registry.series]
        if count is None:
            count = int(begun["count"] or COUNT) if list(series) == begun["series"].split() else COUNT
        seed = int(begun["seed"] or 0) if seed is None else seed
        return fill(
            self.database, self.registry, count=count, series=series, seed=seed, processes=processes, report=report
        )

    def close(self) -> None:
        """Let go of the file."""
        self.database.close()

    def __repr__(self) -> str:
        return f"<Catalogue {self.database.path}>"
