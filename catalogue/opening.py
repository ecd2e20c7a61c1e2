"""What the package offers at its door: open a catalogue, classify without one."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING

from .facade import Catalogue
from .folders import default_database
from .store import Database

if TYPE_CHECKING:
    import numpy.typing as npt

    from .classification import Classification
    from .linkage import Linkage


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
        Build the database if it is empty, or finish it if a build was interrupted (less than a minute on two cores).
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
    from .classification import classify as classified
    from .plugins import Registry

    return classified(linkage, Registry(plugins).series, tolerance)
