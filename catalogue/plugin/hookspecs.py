"""The whole contract between the catalogue and its plugins.

A plugin is a Python file with functions marked ``@hookimpl`` (``from catalogue.plugin import
hookimpl``).  The specifications here have no body: pluggy calls those of the plugins.
"""

from __future__ import annotations

from collections.abc import Iterable

import pluggy

from ..collections.spec import Collection
from ..kinematics.families import Family
from ..series.series import Series

hookspec = pluggy.HookspecMarker("catalogue")
hookimpl = pluggy.HookimplMarker("catalogue")


@hookspec
def catalogue_families() -> Iterable[Family]:  # type: ignore[empty-body]  # no body
    """Return the linkage families that this plugin adds."""


@hookspec
def catalogue_series() -> Iterable[Series]:  # type: ignore[empty-body]  # no body
    """Return the series that this plugin adds."""


@hookspec
def catalogue_collections() -> Iterable[Collection]:  # type: ignore[empty-body]  # no body
    """Return the collections that this plugin adds.

    Called only when one is asked for, so import inside of it.
    """
