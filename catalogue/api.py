"""The public interface: `open` a catalogue and query it, or `classify` linkages without one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Self, Unpack

from .folders import default_database
from .given import names, switch
from .problem.constraints import Constraints
from .problem.criteria import ANSWERS, DISTINCT
from .problem.request import path_request
from .store import Database

if TYPE_CHECKING:
    import pandas as pd

    from .collections.results import CollectionCandidate
    from .find.candidate import Candidate
    from .find.dwell_results import DwellResults, StandStill
    from .find.results import Found
    from .find.specimens import CollectionResults
    from .find.stored import StoredGuide
    from .kinematics.linkage import LinkageLike
    from .plugin.registry import Registry
    from .populate.fill import Progress
    from .problem.constraints import ConstraintArguments, DwellArguments
    from .problem.request import Request
    from .series.classification import Classification


class Catalogue:
    """A database of guides with what can be asked of it; made by `catalogue.open`.

    Every question raises `InvalidRequest` if the request, a constraint, a bound or a name is
    impossible, and `DatabaseError` if the database cannot be read or written.  A copy asks the same
    file, one that was pickled opens it anew.

    Attributes
    ----------
    database : Database
    """

    def __init__(self, database: Database, plugins: Sequence[str] = ()) -> None:
        self.database = database
        self._folders = names("plugins", plugins)

    @cached_property
    def registry(self) -> Registry:
        """The plugins, loaded when first needed: a `find` needs none."""
        from .plugin.registry import Registry

        return Registry(self._folders)

    @property
    def complete(self) -> bool:
        """Whether the last build ran to its end."""
        return self.database.get_setting("complete") == "yes"

    def find(
        self,
        request: Request,
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
        request : StraightLine or CircularArc
        limit : int
            How many at most.
        rank_by : str, mapping or sequence of str
            One of `catalogue.problem.criteria.CRITERIA`, or several with weights:
            ``"size=1,transmission=0.5"``.  A sequence, ``["size", "deviation"]``, weighs nothing:
            the Pareto front of these criteria comes first, spread over all of it, then the second
            front; `Candidate.front` says which.
        per_series : int, optional
            At most so many of one series as long as there are others; a quarter of the limit if not
            given (no bound for a front), 0: no bound.
        distinct : float
            No two answers are nearer to each other than this, 0 to 1; of such only the best is
            given.  About the part of the stroke by which a pivot near the path is moved; see
            `catalogue.candidates.select` and `Candidate.nearest`.
        effort : int
            How often to search, from other starts each time: the best is never worse for more, the
            time grows with it. For 1, a search by score ends with a full list of which the best
            scores 95 (`catalogue.search`).
        refine : bool
            Move the pivots until what is ranked is best, subject to the deviation and all
            constraints; `Candidate.gap` says what could still be gained nearby.  Else guides are
            given as they are stored, or made.
        cognates : bool
            Offer the cognates of four-bars and slider-cranks too: the same path, other pivots; see
            `Candidate.cognate`.
        round_to : float, optional
            Round the lengths of links, and the place of the guided point in the coupler, to
            multiples of this; each rounded linkage is placed anew where it guides best, then
            judged.  See `Candidate.lengths`.
        desires : mapping of str to (best, worst) or (best, worst, weight), optional
            What makes the score: a size, transmission angle, allowance, shortest link
            (``min_link``), distance of the fixed pivots (``min_ground``) or longest travel of a
            slide (``travel``) is desired fully from `best` on and not at all from `worst` on;
            lengths in the user's unit.
        starts : iterable of Candidate
            Answers of an earlier request, or stretches of linkages of your own, to start from too:
            where they meet the constraints the best answer is none worse, so that a looser request
            has no worse answer than a tighter one.
        **constraints
            See `catalogue.Constraints`.
        """
        from .find.find import find

        return find(
            self,
            request,
            Constraints.of(constraints, Catalogue.find.__kwdefaults__ or ()),
            limit=limit,
            rank_by=rank_by,
            per_series=per_series,
            distinct=distinct,
            effort=effort,
            refine=refine,
            cognates=cognates,
            round_to=round_to,
            desires=desires,
            starts=starts,
        )

    def find_dwells(
        self, request: StandStill, *, limit: int = ANSWERS, effort: int = 1, **constraints: Unpack[DwellArguments]
    ) -> DwellResults:
        """Search six-bar dwell mechanisms: the rocker rests while the crank turns on.

        The largest transmission angle comes first; no series has more than a third of the list
        while others have answers.

        Parameters
        ----------
        request : StandStill
        limit : int
            How many at most.
        effort : int
            How many stored arcs of each series are looked at, 150 per unit.
        **constraints
            families, series, configurations, order, pins_only and min_transmission of
            `catalogue.Constraints`.
        """
        from .find.dwells import find_dwells

        wanted = Constraints.of(constraints, Catalogue.find_dwells.__kwdefaults__ or ())
        return find_dwells(self.database, request, wanted, limit=limit, effort=effort)

    def find_in(
        self,
        name: str,
        request: Request,
        *,
        limit: int = ANSWERS,
        rank_by: str = "deviation",
        families: Sequence[str] = (),
        series: Sequence[str] = (),
        where: Mapping[str, tuple[float | None, float | None]] | None = None,
        special: Sequence[str] = (),
        refine: bool = False,
        quiet: bool = False,
    ) -> CollectionResults:
        """Search a collection of a plugin; rank and verify its mechanisms on their finite motion.

        The specimens of the collection are drawn on first use, or when a newer plugin draws them
        otherwise, with a progress bar unless `quiet`.

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
        special : sequence of str
            Only mechanisms that are one of these well-known cases.
        refine : bool
            Move the answers until they deviate less, where the collection knows how; bounds and
            names are kept.  It takes some seconds for each.

        Raises
        ------
        PluginError
            If there is no such collection, or it breaks its contract.
        """
        from .find.specimens import find_in
        from .populate.collect import is_current

        request, quiet = path_request("find_in", request), switch("quiet", quiet)
        collection = self.registry.collection(name)

        def drawn() -> None:
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
            refine=switch("refine", refine),
            drawn=drawn,
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

        Raises
        ------
        InvalidRequest
            If there is no such specimen.
        PluginError
            If there is no such collection.
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
        """Draw the specimens of a collection up to a number; see `catalogue.populate.collect.collect`."""
        from .populate.collect import collect

        collection = self.registry.collection(name)
        version = self.registry.provider(name).version
        return collect(self.database, collection, version, count=count, seed=seed, report=report)

    def guide(self, name: int | str) -> StoredGuide:
        """Return a stored guide by its id, or the first guide of a named design."""
        from .find.stored import stored

        return stored(self.database, name)

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
    ) -> pd.DataFrame:
        """Return what is stored as a table, one row per guide by its number; no search, no plugin.

        Lengths are in the canonical frame of the mechanism: pole at the origin, pole tangent along
        +x, unit inflection circle (of parallel cranks, ``rho0`` NaN: the height of crank 1).
        ``catalogue schema`` says what each column means.  NaN, of text None or NaN: there is none.

        Parameters
        ----------
        series, families, configurations : str or sequence of str
            Only these; all if empty.
        kind : str or sequence of str
            Only these of line, circle, slot, arc, return-line and return-circle.
        order : int
            Least order of contact at the design position; 99: exact.
        pins_only : bool
            No sliding joint.
        reaches : bool
            One row per reach of a guide, the loosest level first: the same columns, repeated, and
            those of the reach.

        Returns
        -------
        DataFrame
            id, name (of a design), family, series, member, configuration, kind, label,
            contact_order, inflections, leading, cover; x, y, tangent_x, tangent_y, curvature of the
            nominal; pivots ``fixed_1_x``, ``fixed_1_y``, ``fixed_1_w`` (A1), ``moving_1_x`` (A1*),
            ``fixed_2_x`` (A2), ``moving_2_x`` (A2*) and so on, w = 0 at infinity; rho0, kappa,
            kappa_star, s of the cubics; mechanism_id; ``parameter_NAME`` of the members that have
            such a free parameter.  With `reaches` also level, stroke (canonical) and, in strokes
            and degrees, deviation, size, max_link, min_link, max_ground, max_arm, min_transmission,
            rotates, drive_angle, rotation and the others of `catalogue.store.Reach`.
        """
        from .find.frame import guides_frame

        constraints = Constraints(families, series, configurations, pins_only, order)
        return guides_frame(self.database, constraints, names("kind", kind), reaches=switch("reaches", reaches))

    def classify(self, linkage: LinkageLike, *, tolerance: float | None = None) -> Classification:
        """Return the memberships of given linkages in all series that are registered; see `catalogue.classify`."""
        from .series.classification import classify

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
        """Fill the database up to `count` guides, or finish an interrupted build; see `catalogue.populate.fill`."""
        from .populate.fill import COUNT, fill
        from .populate.plan import share_of

        series = names("series", series)
        begun = (self.database.get_setting("series") or "").split()
        if count is None and not series and not self.complete:  # finish what was begun
            series = tuple(code for code in begun if code in self.registry.series)
        if count is None:
            share = share_of(self.registry, series, COUNT) if series else COUNT  # as dense a net as of the others
            count = self.database.get_number("count", share) if list(series) == begun else share
        seed = self.database.get_number("seed", 0) if seed is None else seed
        return fill(
            self.database, self.registry, count=count, series=series, seed=seed, processes=processes, report=report
        )

    def close(self) -> None:
        """Let go of the file."""
        self.database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[type[Self], tuple[Database, tuple[str, ...]]]:
        """Reduce to the file and the plugin folders: a copy loads plugins anew, an unpickled one opens the file."""
        return type(self), (self.database, self._folders)

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
        Build the database if it is empty, or finish it if a build was interrupted (less than a
        minute on two cores); where another process builds it, wait for that.
    quiet : bool
        No progress bar while building.

    Raises
    ------
    DatabaseError
        If the file cannot be used.
    InvalidRequest
        If an argument is of another type.
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
    """Return the memberships of given linkages in all series; no database is opened.

    Parameters
    ----------
    linkage : Linkage, its pivots, or a mapping of link lengths
        ``[[A1, A1*], [A2, A2*]]``, each pivot (x, y) or (x, y, w), of one linkage or of n; or
        ``{"ground": 4, "crank": 2, "coupler": 3, "rocker": 3, "angle": 60}``: see
        `catalogue.kinematics.from_lengths`.
    tolerance : float, optional
        Residual up to which a series holds, if its margin is larger; 1e-9, for pivots rounded to
        double precision, if not given.  Give more for proportions rounded to a few digits.
    plugins : sequence of str
        Folders with plugins, besides the built-in one and those of ``CATALOGUE_PLUGINS``.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If the pivots or lengths make no linkage, or the tolerance is not in [0, 1).
    """
    from .plugin.registry import Registry
    from .series.classification import classify as classified

    return classified(linkage, Registry(plugins).series, tolerance)
