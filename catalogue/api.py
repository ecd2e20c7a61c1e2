"""The public interface: `open` a catalogue and query it, or `classify` linkages without one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, Self, TypedDict, Unpack, overload

from .folders import default_database
from .given import names, switch, whole
from .problem.constraints import Constraints
from .problem.criteria import ANSWERS, DISTINCT
from .problem.path import path_request
from .store import Database

if TYPE_CHECKING:
    import pandas as pd

    from .collections.results import CollectionCandidate
    from .find.specimens import CollectionResults
    from .find.stored import StoredGuide
    from .guides.candidate import Candidate
    from .guides.dwell import DwellResults, StandStill
    from .guides.results import Found
    from .kinematics.linkage import LinkageLike
    from .plugin.registry import Registry
    from .problem.constraints import ConstraintArguments, DwellArguments
    from .problem.path import PathRequest
    from .problem.problem import Request
    from .progress import Progress
    from .series.classification import Classification


class GuideSelection(TypedDict, total=False):
    """Keywords of `Catalogue.guides` that select guides."""

    series: str | Sequence[str]
    families: str | Sequence[str]
    configurations: str | Sequence[str]
    kind: str | Sequence[str]
    order: int
    pins_only: bool
    reaches: bool


class Catalogue:
    """A database of guides with its queries; made by `catalogue.open`.

    Every query raises `InvalidRequest` for an invalid request, constraint or name, and
    `DatabaseError` if the database cannot be read or written.  A copy uses the same file; a pickled
    one reopens it.

    Attributes
    ----------
    database : Database

    Examples
    --------
    >>> from catalogue import StraightLine
    >>> found = cat.find(StraightLine(stroke=150, deviation=0.5), families=["four-bar"], limit=2)
    >>> [one.deviation <= 0.5 for one in found]
    [True, True]
    """

    def __init__(self, database: Database, plugins: Sequence[str] = ()) -> None:
        self.database = database
        self.plugin_folders = names("plugins", plugins)

    @cached_property
    def registry(self) -> Registry:
        """The plugins, loaded on first use: `find` needs none."""
        from .plugin.registry import Registry

        return Registry(self.plugin_folders)

    @property
    def complete(self) -> bool:
        """Whether the last build was completed."""
        return self.database.get_setting("complete") == "yes"

    def find(
        self,
        request: PathRequest | Request,
        *,
        limit: int = ANSWERS,
        rank_by: str | Mapping[str, float] | Sequence[str] = "score",
        per_series: int | None = None,
        distinct: float = DISTINCT,
        effort: int = 1,
        refine: bool = True,
        cognates: bool = False,
        round_to: float | None = None,
        desires: Mapping[str, Sequence[float]] | None = None,
        starts: Iterable[Candidate] = (),
        **constraints: Unpack[ConstraintArguments],
    ) -> Found:
        """Search guides for a request; rank and verify them on their finite motion.

        Parameters
        ----------
        request : StraightLine, CircularArc or Request
            Path and tolerance, to which the keywords below are added; or the whole request, which
            takes `starts` alone.
        limit : int
            Maximum number of answers.
        rank_by : str, mapping or sequence of str
            One of `catalogue.problem.criteria.CRITERIA`, or several with weights:
            ``"size=1,transmission=0.5"``.  A sequence, ``["size", "deviation"]``, ranks by Pareto
            fronts without weights; `Candidate.front` is the number of the front.
        per_series : int, optional
            Maximum number of answers of one series while others have answers; 0: no limit.
            Default: a quarter of `limit`, no limit for Pareto fronts.
        distinct : float
            Minimum distance between two answers as designs, 0 to 1: about the displacement of a
            pivot near the path over the stroke.  See `catalogue.candidates.select` and
            `Candidate.nearest`.
        effort : int
            Number of searches, each from other starts: more is never worse, and takes as much
            longer.  At 1, a search by score ends early with a full list whose best answer scores
            95.  At 0 it ends with the first answers.
        refine : bool
            Optimise the pivots for the ranking, subject to the tolerance and all constraints;
            `Candidate.gap` estimates the remaining improvement nearby.  Else return guides as
            stored or synthesised.
        cognates : bool
            Also offer cognates of four-bars and slider-cranks: same path, other pivots; see
            `Candidate.cognate`.
        round_to : float, optional
            Round link lengths and coupler coordinates of the guided point to multiples of this;
            each rounded linkage is placed again where it guides best, then checked [length].
        desires : mapping of str to (best, worst) or (best, worst, weight), optional
            Desirabilities in the score, 1 at `best`, 0 at `worst`, of quantities in
            `catalogue.problem.ranking.DESIRES` [length, deg].
        starts : iterable of Candidate
            Further starts: answers to earlier requests, or stretches of your own linkages.  If one
            meets the constraints, the best answer is no worse.
        **constraints
            See `catalogue.Constraints`.

        Returns
        -------
        Found
        """
        from .find.find import find
        from .problem.problem import Request

        asked = Request.of(
            request,
            options=["starts"],
            limit=limit,
            rank_by=rank_by,
            per_series=per_series,
            distinct=distinct,
            effort=effort,
            refine=refine,
            cognates=cognates,
            round_to=round_to,
            desires=desires,
            **constraints,
        )
        return find(self, asked, starts)

    def improving(self, request: Request, starts: Iterable[Candidate] = ()) -> Iterator[Found]:
        """Yield better and better answers to a request while the search goes on.

        The first come after about a third of the time of `find`, the last are those of `find`.
        Stop whenever they are good enough.

        Parameters
        ----------
        request : Request
        starts : iterable of Candidate
            Further starts; see `find`.

        Yields
        ------
        Found
            All answers so far, best first, verified; none only if `find` has none.

        Raises
        ------
        InvalidRequest
            The request names what the database does not have.

        Examples
        --------
        >>> import catalogue
        >>> request = catalogue.Request.of(catalogue.StraightLine(150, 0.05), max_size=250, limit=1)
        >>> scores = [found[0].score for found in cat.improving(request)]
        >>> scores[0] <= scores[-1] == cat.find(request)[0].score
        True
        """
        from .find.find import improving

        return improving(self, request, tuple(starts))

    def find_many(self, requests: Iterable[Request]) -> list[Found]:
        """Answer several requests, each from the answers to tighter ones among them.

        That is quicker than a `find` for each, and hardly ever is a looser request answered worse
        than a tighter one.  For results in a file, on several cores or machines, see
        `catalogue.Study`.

        Parameters
        ----------
        requests : iterable of Request
            Requests in any order; equal ones are answered once.

        Returns
        -------
        list of Found
            The answers to each, in the order given.

        Raises
        ------
        InvalidRequest
            One is no `Request`, or names what the database does not have.

        Examples
        --------
        >>> import catalogue
        >>> cat = catalogue.open()
        >>> paths = [catalogue.StraightLine(150, deviation) for deviation in (0.5, 0.1)]
        >>> loose, tight = cat.find_many([catalogue.Request(path, limit=3) for path in paths])
        >>> loose.request.path.deviation, len(loose), len(tight)
        (0.5, 3, 3)
        """
        from .find.many import find_many

        return find_many(self, [*requests])

    def find_dwells(
        self, request: StandStill, *, limit: int = ANSWERS, effort: int = 1, **constraints: Unpack[DwellArguments]
    ) -> DwellResults:
        """Search six-bar dwell mechanisms: the rocker rests while the crank turns on.

        All pivots are refined for the transmission angle, and the largest comes first; no series
        has more than a third of the list while others have answers.

        Parameters
        ----------
        request : StandStill
        limit : int
            Maximum number of answers.
        effort : int
            Number of stored arcs to try per series, in units of 150.
        **constraints
            families, series, configurations, order, pins_only, min_transmission and max_size of
            `catalogue.Constraints`; `max_size` is ten lengths of the crank by default.

        Returns
        -------
        DwellResults
        """
        from .find.dwells import find_dwells

        wanted = Constraints.of(constraints, Catalogue.find_dwells.__kwdefaults__ or ())
        return find_dwells(self.database, request, wanted, limit=limit, effort=effort)

    def find_in(
        self,
        name: str,
        request: PathRequest,
        *,
        limit: int = ANSWERS,
        rank_by: str = "deviation",
        families: Sequence[str] = (),
        series: Sequence[str] = (),
        where: Mapping[str, tuple[float | None, float | None]] | None = None,
        special: Sequence[str] = (),
        refine: bool | None = None,
        effort: int = 1,
        quiet: bool = False,
        **constraints: Any,
    ) -> CollectionResults:
        """Search a collection of a plugin; rank and verify its mechanisms on their finite motion.

        The specimens of the collection are sampled on first use, or after an update of its plugin;
        an empty database is filled first where mechanisms are made of the four-bars found in it.

        Parameters
        ----------
        name : str
            Name of the collection; `Registry.collections` lists them.
        request : StraightLine or CircularArc
            Path and tolerance.
        limit : int
            Maximum number of answers.
        rank_by : str
            ``deviation``, or a metric of the collection.
        families, series : sequence of str
            Permitted ones; all if empty.
        where : mapping of str to (least, most)
            Bounds on metrics, None for an open side: ``{"condition": (None, 50.0)}``.
        special : sequence of str
            Permitted special cases of the collection; any if empty.
        refine : bool, optional
            Refine the answers and specimens near the request within the bounds, for what is ranked.
            By default where fewer than `limit` specimens suffice, if the collection's refinement is
            quick.
        effort : int
            Number of stored mechanisms to follow on their finite motion, in units of 1024, and of
            those to refine, in units of the collection's own.
        quiet : bool
            Show no progress bar.
        **constraints
            Further ones of `catalogue.Constraints`: pins_only; bounds on what the collection
            measures, such as max_size; of planar mechanisms full_rotation, fixed_pivots_in,
            pivots_in, swept_in and keep_out.  A mechanism is mirrored where that fits regions.

        Returns
        -------
        CollectionResults

        Raises
        ------
        InvalidRequest
            If a value is invalid, or the collection does not have what is constrained.
        PluginError
            If the collection is unknown, or breaks its contract.
        """
        from .find.specimens import find_in
        from .populate.collect import is_current

        request, quiet = path_request("find_in", request), switch("quiet", quiet)
        collection = self.registry.collection(name)

        def drawn() -> None:
            if collection.starts is not None and not self.database.has_guides:
                from .populate.first_use import build_once

                build_once(self, quiet=quiet)
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
            special=special,
            refine=None if refine is None else switch("refine", refine),
            effort=effort,
            drawn=drawn,
            find=self.find,
            **constraints,
        )

    def specimen(self, name: str, number: int, stroke: float = 1.0) -> CollectionCandidate:
        """Return a stored specimen of a collection, placed along a path and measured.

        Parameters
        ----------
        name : str
            Name of the collection.
        number : int
            Number of the specimen in the database.
        stroke : float
            Length of the path [length].

        Returns
        -------
        CollectionCandidate

        Raises
        ------
        InvalidRequest
            If the specimen is unknown.
        PluginError
            If the collection is unknown.
        """
        from .find.specimens import specimen

        return specimen(self.database, self.registry.collection(name), number, stroke)

    def build_collection(
        self,
        name: str,
        *,
        count: int | None = None,
        seed: int | None = None,
        report: Callable[[Progress], None] = lambda _: None,
    ) -> Progress:
        """Sample the specimens of a collection.

        Parameters
        ----------
        name : str
            Name of the collection.
        count : int, optional
            Number of specimens to store.
        seed : int, optional
            Seed of the sampling.
        report : callable
            Receives the `Progress` now and then.

        Returns
        -------
        Progress
        """
        from .populate.collect import collect

        collection = self.registry.collection(name)
        version = self.registry.provider(name).version
        return collect(self.database, collection, version, count=count, seed=seed, report=report)

    def guide(self, name: int | str) -> StoredGuide:
        """Return a stored guide.

        Parameters
        ----------
        name : int or str
            Number of the guide, or name of a design, such as ``"watt"``.

        Returns
        -------
        StoredGuide
        """
        from .find.stored import stored

        return stored(self.database, name)

    @overload
    def guides(self, *, chunksize: None = None, **selection: Unpack[GuideSelection]) -> pd.DataFrame: ...
    @overload
    def guides(self, *, chunksize: int, **selection: Unpack[GuideSelection]) -> Iterator[pd.DataFrame]: ...
    def guides(
        self,
        *,
        series: str | Sequence[str] = (),
        families: str | Sequence[str] = (),
        configurations: str | Sequence[str] = (),
        kind: str | Sequence[str] = (),
        order: int = 0,
        pins_only: bool = False,
        reaches: bool = False,
        chunksize: int | None = None,
    ) -> pd.DataFrame | Iterator[pd.DataFrame]:
        """Return stored guides as a data frame, one row per guide by number; no search, no plugin.

        Lengths are canonical: pole at the origin, pole tangent along +x, unit inflection circle
        (parallel cranks, ``rho0`` NaN: unit height of crank 1).  ``catalogue schema`` explains the
        columns.  Missing values are NaN or None.

        Parameters
        ----------
        series, families, configurations : str or sequence of str
            Permitted ones; all if empty.
        kind : str or sequence of str
            Permitted ones of line, circle, slot, arc, return-line and return-circle; all if empty.
        order : int
            Minimum order of contact at the design position; 99: exact.
        pins_only : bool
            Revolute joints only, no sliders.
        reaches : bool
            One row per reach of a guide, the loosest level first, with additional columns.
        chunksize : int, optional
            Guides per frame; an iterator of frames is returned then, for a large database.

        Returns
        -------
        DataFrame, or iterator of DataFrame
            id, name (of a design), family, series, member, configuration, kind, label,
            contact_order, inflections, leading, cover; x, y, tangent_x, tangent_y, curvature of the
            nominal; pivots ``fixed_1_x``, ``fixed_1_y``, ``fixed_1_w`` (A1), ``moving_1_x`` (A1*),
            ``fixed_2_x`` (A2), ``moving_2_x`` (A2*) and so on, w = 0 at infinity; rho0, kappa,
            kappa_star, s of the cubics; mechanism_id; ``parameter_NAME`` of the members that have
            such a free parameter.  With `reaches` also level, stroke (canonical), and in strokes
            and degrees deviation, all of `catalogue.quantities.STORED` and the others of
            `catalogue.store.Reach`.
        """
        from .find.frame import GuideFrames

        constraints = Constraints(families, series, configurations, pins_only, order)
        frames = GuideFrames(self.database, constraints, names("kind", kind), switch("reaches", reaches))
        return frames.whole() if chunksize is None else frames.parts(whole("chunksize", chunksize, 1))

    def classify(self, linkage: LinkageLike, *, tolerance: float | None = None) -> Classification:
        """Find the series of linkages among all registered ones; see `catalogue.classify`.

        Parameters
        ----------
        linkage : Linkage, its pivots, or a mapping of link lengths
        tolerance : float, optional
            Largest residual of a member.

        Returns
        -------
        Classification
        """
        from .series.classification import classify

        return classify(linkage, self.registry.series, tolerance)

    def build(
        self,
        *,
        count: int | None = None,
        series: Sequence[str] = (),
        seed: int | None = None,
        processes: int | None = None,
        engine: str = "processes",
        report: Callable[[Progress], None] = lambda _: None,
    ) -> Progress:
        """Fill the database, or finish an interrupted build; see `catalogue.populate.fill`.

        Parameters
        ----------
        count : int, optional
            Number of guides to store; default: 12,000, or as begun.
        series : sequence of str
            Series to sample; all if empty.
        seed : int, optional
            Seed of the sampling; default: 0, or as begun.
        processes : int, optional
            Number of worker processes; default: one per processor.
        engine : str
            ``serial``, ``processes`` or ``dask``, the latter with ``:N`` or ``:ADDRESS``; see
            `catalogue.engines.engine`.  The content is the same on all of them.
        report : callable
            Receives the `Progress` now and then.

        Returns
        -------
        Progress
        """
        from .populate.fill import FILL, fill
        from .populate.plan import share_of

        series = names("series", series)
        begun = (self.database.get_setting("series") or "").split()
        if count is None and not series and not self.complete:  # finish an interrupted build
            series = tuple(code for code in begun if code in self.registry.series)
        if count is None:
            # give these series as dense a cover as the others have
            share = share_of(self.registry, series, FILL.guides) if series else FILL.guides
            count = self.database.get_number("count", share) if list(series) == begun else share
        seed = self.database.get_number("seed", 0) if seed is None else seed
        return fill(
            self.database,
            self.registry,
            count=count,
            series=series,
            seed=seed,
            processes=processes,
            on=engine,
            report=report,
        )

    def close(self) -> None:
        """Close the database file."""
        self.database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[type[Self], tuple[Database, tuple[str, ...]]]:
        """Reduce to file and plugin folders: a copy loads the plugins again."""
        return type(self), (self.database, self.plugin_folders)

    def __repr__(self) -> str:
        return f"<Catalogue {self.database.path}>"


def open(
    path: str | PathLike[str] | None = None, *, plugins: Sequence[str] = (), build: bool = True, quiet: bool = False
) -> Catalogue:
    """Open the catalogue, building its database on first use.

    Parameters
    ----------
    path : path, optional
        Database file; default: ``CATALOGUE_DB``, else a file in the user's data directory.
    plugins : sequence of str
        Folders with plugins, in addition to the built-in one and those of ``CATALOGUE_PLUGINS``.
    build : bool
        Build an empty database, or finish an interrupted build (less than a minute on two cores);
        wait if another process builds it.
    quiet : bool
        Show no progress bar.

    Returns
    -------
    Catalogue

    Raises
    ------
    DatabaseError
        If the file cannot be used.
    InvalidRequest
        If an argument has a wrong type.

    Examples
    --------
    >>> import catalogue
    >>> with catalogue.open(cat.database.path, build=False) as again:
    ...     again.guide("watt").name
    'watt'
    """
    build, quiet = switch("build", build), switch("quiet", quiet)
    opened = Catalogue(Database.open(path if path is not None else default_database()), plugins)
    try:
        if build and not opened.complete:
            from .populate.first_use import build_once

            build_once(opened, quiet=quiet)
    except BaseException:
        opened.close()
        raise
    return opened


def classify(linkage: LinkageLike, *, tolerance: float | None = None, plugins: Sequence[str] = ()) -> Classification:
    """Find the series of linkages; no database is opened.

    Parameters
    ----------
    linkage : Linkage, its pivots, or a mapping of link lengths
        ``[[A1, A1*], [A2, A2*]]``, each pivot (x, y) or (x, y, w) with w = 0 at infinity, of one
        linkage or of n; or ``{"ground": 4, "crank": 2, "coupler": 3, "rocker": 3, "angle": 60}``:
        see `catalogue.kinematics.from_lengths`.
    tolerance : float, optional
        Largest residual of a member, if the margin of the series is larger.  Default: 1e-9, for
        pivots in double precision; increase it for rounded proportions.
    plugins : sequence of str
        Folders with plugins, in addition to the built-in one and those of ``CATALOGUE_PLUGINS``.

    Returns
    -------
    Classification
        Memberships of each linkage.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If the linkage is invalid, or the tolerance is not in [0, 1).

    Examples
    --------
    >>> import catalogue
    >>> watt = [[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]
    >>> catalogue.classify(watt)[0].series
    ['IV*.l']
    """
    from .plugin.registry import Registry
    from .series.classification import classify as classified

    return classified(linkage, Registry(plugins).series, tolerance)
