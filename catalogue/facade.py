"""The catalogue as a user holds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from .errors import InvalidRequest
from .folders import default_database
from .linkage import Linkage
from .query.explain import explain
from .query.find import Trail, answer, check_names
from .query.found import Found, candidates
from .query.ranking import Ranking
from .query.request import DISTINCT, Constraints, Request, positive, whole
from .store import Database, get_setting

if TYPE_CHECKING:
    from .build import Progress
    from .classification import Classification
    from .plugins import Registry
    from .query.collected import Collected
    from .query.lay import Answers
    from .query.standstill import Dwellings, StandStill
    from .query.stored import StoredGuide


class Catalogue:
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
        rank_by: str | Mapping[str, float] | Sequence[str] = "balance",
        per_series: int | None = None,
        distinct: float = DISTINCT,
        effort: int = 1,
        refine: bool = True,
        cognates: bool = False,
        round_to: float | None = None,
        **constraints: Any,
    ) -> Found:
        """Return the best guides for a request, each verified on its finite motion at the stroke asked for.

        Parameters
        ----------
        request : StraightLine or CircularArc
        limit : int
            How many at most.
        rank_by : str, mapping or sequence of str
            One of `catalogue.query.request.CRITERIA`, or several with weights: ``"size=1,transmission=0.5"``.  A
            sequence, ``["size", "deviation"]``, weighs nothing: the Pareto front of these criteria comes first, spread
            over all of it, then the second front; `Candidate.front` says which.
        per_series : int, optional
            At most so many of one series as long as there are others; a third of the limit if not given (no bound
            for a front), 0: no bound.
        distinct : float
            No two answers are nearer to each other than this, 0 to 1; of such only the best is given.  About the part
            of the stroke by which a pivot near the path is moved; see `catalogue.query.likeness` and
            `Candidate.nearest`.
        effort : int
            How many stored candidates are traced, 400 per unit, and refined, 20 per unit, in more rounds.
        refine : bool
            Move the pivots and the guided point of the best candidates so that their deviation becomes least while all
            constraints hold; `Candidate.unrefined` says what it was, `Candidate.gap` how good it is now.
        cognates : bool
            Offer the cognates of four-bars and slider-cranks too: the same path, other pivots; see `Candidate.cognate`.
        round_to : float, optional
            Make the lengths of links, and the place of the guided point in the coupler, multiples of this; see
            `Candidate.lengths`.
        **constraints
            See `catalogue.query.request.Constraints`.

        Raises
        ------
        InvalidRequest
            If the request, a constraint or a name is impossible.
        DatabaseError
            If the database cannot be read.
        """
        if not isinstance(request, Request):
            raise InvalidRequest(f"find wants a StraightLine or CircularArc, not {request!r}")
        limit, effort = whole("limit", limit, 1), whole("effort", effort, 1)
        wanted = _constraints(constraints)
        ranking = Ranking.of(rank_by, per_series, distinct, limit)
        trail = Trail()
        if round_to is not None:
            round_to = positive("round_to", round_to)
        if wanted.given and (cognates or round_to is not None):
            raise InvalidRequest(
                "cognates and round_to move the pivots: they cannot be asked for where pivots are given"
            )
        if wanted.given:
            return self._constructed(request, wanted, ranking, limit=limit, effort=effort, trail=trail)
        check_names(self.database, wanted)
        found = answer(
            self.database,
            request,
            wanted,
            ranking,
            limit=limit,
            effort=effort,
            trail=trail,
            refine=refine,
            cognates=cognates,
            round_to=round_to,
        )
        if found is not None and refine:
            stop = trail.timed("drift")
            found = self._with_drift(found, wanted)
            stop()
        listed = candidates(found, request, wanted.play) if found is not None else []
        return Found(listed, lambda: explain(self.database, request, wanted, trail, len(listed)))

    def _with_drift(self, found: Answers, wanted: Constraints) -> Answers:
        from .refine import drift

        return replace(found, rows=found.rows | {"drift": drift(found, self.registry.series, wanted.slots)})

    def _constructed(
        self, request: Request, wanted: Constraints, ranking: Ranking, *, trail: Trail, **how: int
    ) -> Found:
        """Return guides with the given pivots, made in closed form and refined: the database is not asked."""
        from .query.construct import constructed
        from .query.explain import explain_constructed

        found = constructed(self.registry.series, request, wanted, ranking, trail=trail, **how)
        listed = candidates(found, request, wanted.play) if found is not None else []
        return Found(listed, lambda: explain_constructed(request, wanted, trail, len(listed)))

    def find_dwells(self, request: StandStill, *, limit: int = 12, effort: int = 1, **constraints: Any) -> Dwellings:
        """Return crank-driven linkages with a dyad whose rocker stands still, the best transmission angle first.

        Parameters
        ----------
        request : StandStill
        limit : int
            How many at most.
        effort : int
            How many stored arcs of each series are looked at, 150 per unit.
        **constraints
            families, series, configurations, order, pins_only and min_transmission of
            `catalogue.query.request.Constraints`.

        Raises
        ------
        InvalidRequest
            If the request, a constraint or a name is impossible.
        DatabaseError
            If the database cannot be read.
        """
        from .query.dwells import find_dwells
        from .query.standstill import StandStill

        if not isinstance(request, StandStill):
            raise InvalidRequest(f"find_dwells wants a StandStill, not {request!r}")
        wanted = _constraints(constraints)
        known = {"families", "series", "configurations", "order", "pins_only", "min_transmission"}
        other = [name for name in wanted.active() if name not in known]
        if other:
            raise InvalidRequest(f"{other[0]} does not go with a dwell; there are {', '.join(sorted(known))}")
        check_names(self.database, wanted)
        limit, effort = whole("limit", limit, 1), whole("effort", effort, 1)
        return find_dwells(self.database, request, wanted, limit=limit, effort=effort)

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
        from .query.find_in import find_in

        if not isinstance(request, Request):
            raise InvalidRequest(f"find_in wants a StraightLine or CircularArc, not {request!r}")
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
        from .query.stored import stored

        return stored(self.database, name)

    def classify(self, linkage: Linkage | npt.ArrayLike, *, tolerance: float | None = None) -> Classification:
        """Return the memberships of given linkages in all series that are registered; see `catalogue.classify`."""
        return _classify(linkage, self.registry, tolerance)

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

    def __enter__(self) -> Catalogue:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Catalogue {self.database.path}>"


def open(
    path: str | PathLike[str] | None = None, *, plugins: Sequence[str] = (), build: bool = True, quiet: bool = False
) -> Catalogue:
    """Open the catalogue, building its database on first use.

    Parameters
    ----------
    path : path, optional
        Database file; if not given ``CATALOGUE_DB``, else a file in the user's data directory.
    plugins : sequence of str
        Folders with plugins, besides the built-in one and those of ``CATALOGUE_PLUGINS``.
    build : bool
        Build the database if it is empty, or finish it if a build was interrupted (70 s on two cores).
    quiet : bool
        No progress bar while building.

    Raises
    ------
    DatabaseError
        If the file cannot be used.
    """
    opened = Catalogue(Database.open(path if path is not None else default_database()), plugins)
    try:
        if build and not opened.complete:
            from .progress import shown

            with shown(quiet=quiet, label="building the catalogue") as report:
                opened.build(report=report)
    except BaseException:
        opened.close()
        raise
    return opened


def classify(
    linkage: Linkage | npt.ArrayLike, *, tolerance: float | None = None, plugins: Sequence[str] = ()
) -> Classification:
    """Return the memberships of given linkages in all series; no database is opened.

    Parameters
    ----------
    linkage : Linkage or array_like, shape (2, 2, 3) or (n, 2, 2, 3)
    tolerance : float, optional
        Residual up to which a series holds, if its margin is larger; 1e-9, for pivots rounded to double precision, if
        not given.  Give more for proportions rounded to a few digits.
    plugins : sequence of str
        Folders with plugins, besides the built-in one and those of ``CATALOGUE_PLUGINS``.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If the pivots are no linkage, or the tolerance is not in [0, 1).
    """
    from .plugins import Registry

    return _classify(linkage, Registry(plugins), tolerance)


def _constraints(given: dict[str, Any]) -> Constraints:
    try:
        return Constraints(**given)
    except TypeError as error:
        raise InvalidRequest(f"unknown constraint: {str(error).split('argument')[-1].strip()}") from None


def _classify(linkage: Linkage | npt.ArrayLike, registry: Registry, tolerance: float | None) -> Classification:
    from .classification import TOLERANCE, classify

    given = linkage if isinstance(linkage, Linkage) else Linkage(linkage)
    return classify(given, registry.series, TOLERANCE if tolerance is None else tolerance)


__all__ = ["Catalogue", "classify", "open"]
