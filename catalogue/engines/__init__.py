"""Engines: executors of `concurrent.futures` on which builds, studies and the page run their tasks.

`serial` runs tasks in this process, `processes` in worker processes of this machine, `cluster` on
workers of dask.distributed (extra ``dask``), here or on other machines.  A worker that is killed is
replaced and its task tried again; the result of a task is the same on every engine.  Import
`engine`, `Engine` and `Begin` from here.  This room imports `errors` and
`given`.
"""

from __future__ import annotations

from .base import Begin, Engine
from .choose import check_name, engine

__all__ = ["Begin", "Engine", "check_name", "engine"]
