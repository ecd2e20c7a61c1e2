"""Choose an engine by its name."""

from __future__ import annotations

import os

from ..errors import InvalidRequest, quoted
from ..given import whole
from .base import TRIES, Begin, Engine

#: Names of engines; ``processes`` and ``dask`` may be followed by a number of workers, ``dask`` by
#: an address.
NAMES = ("serial", "processes", "dask")


def check_name(name: str) -> tuple[str, str]:
    """Split the name of an engine into kind and rest: a number of workers, or an address.

    Raises
    ------
    InvalidRequest
        If there is no such engine.
    """
    kind, _, rest = name.partition(":") if isinstance(name, str) else ("", "", "")
    if kind not in NAMES or (kind == "serial" and rest):
        raise InvalidRequest(
            f"there is no engine {quoted(name)}: serial, processes, processes:N, dask, dask:N or dask:ADDRESS"
        )
    if rest.isdecimal():
        whole(f"the number of workers of {kind}", int(rest), 1)
    elif rest and kind == "processes":
        raise InvalidRequest(f"the number of processes must be a whole number, not {quoted(rest)}")
    return kind, rest


def engine(
    name: str, begin: Begin | None = None, *, count: int | None = None, limit: float | None = None, tries: int = TRIES
) -> Engine:
    """Start an engine.

    Parameters
    ----------
    name : str
        ``serial``; ``processes`` or ``processes:4``; ``dask`` or ``dask:4`` for a cluster on this
        machine, ``dask:tcp://HOST:PORT`` for a running one.
    begin : Begin, optional
        Prepares each worker.
    count : int, optional
        Number of workers where the name has none; default: one per processor.
    limit : float, optional
        Time limit of a task in a worker process [s].
    tries : int
        Attempts at a task that kills its worker.

    Returns
    -------
    Engine

    Raises
    ------
    InvalidRequest
        If there is no such engine.
    MissingExtra
        If dask is not installed.
    EngineError
        If the cluster cannot be reached.
    """
    kind, rest = check_name(name)
    if rest.isdecimal():
        count = int(rest)
    if kind == "serial":
        from .serial import Serial

        return Serial(begin)
    if count is None:
        count = os.cpu_count() or 1
    if kind == "processes":
        from .processes import Processes

        return Processes(count, begin, limit=limit, tries=tries)
    from .cluster import Cluster

    return Cluster(begin, address="" if rest.isdecimal() else rest, count=count, tries=tries)
