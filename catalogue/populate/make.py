"""Make a block in a worker."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from ..engines import Begin
from ..errors import PluginError, WorkerKilled, one_line
from ..foreign_code import foreign
from ..plugin.registry import Registry
from .block import Block, block

_REGISTRY: list[Registry] = []
#: Id of the process that requests blocks.
_ASKING: list[int] = []


def begin(folders: Sequence[str]) -> Begin:
    """Return the preparation of a worker that makes blocks with the plugins of folders."""
    return Begin(_load, (tuple(folders), os.getpid()))


def _load(folders: Sequence[str], asking: int) -> None:
    _REGISTRY[:], _ASKING[:] = [Registry(folders)], [asking]


def make(code: str, *how: Any) -> Block:
    """Make a block of a series; `how` are the other arguments of `block`.

    Raises
    ------
    PluginError
        If the plugin fails; `WorkerKilled` if memory is short.
    """
    try:
        if os.getpid() in _ASKING:  # not in a worker: effects of the plugin on this process are undone
            with foreign(f"series {code}"):
                return block(_REGISTRY[0].get(code), *how)
        return block(_REGISTRY[0].get(code), *how)
    except MemoryError as error:
        raise WorkerKilled(one_line(error)) from None
    except BaseException as error:
        raise PluginError(one_line(error)) from None
