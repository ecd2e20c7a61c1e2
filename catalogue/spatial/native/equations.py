"""Interface of compiled equations to `newton` and `curve`.

A kernel registers its functions for the type of its plan, and numba compiles what calls them once
for each: which plan is meant it knows from the type of the first argument.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from numba.extending import overload


def evaluate(plan: Any, geometry: Any, g: int, y: Any, w: Any, jacobian: bool) -> None:
    """Evaluate conditions, the drive last, and their Jacobian if asked for."""


def moved(plan: Any, y: Any, step: Any) -> None:
    """Move a state by a step of all unknowns, in place."""


def unitary(plan: Any, y: Any) -> None:
    """Give quaternions the length 1, in place."""


def lifted(plan: Any, y: Any, step: Any, out: Any) -> None:
    """Find the rates of a state when the unknowns have those given."""


def offer(plan: type, functions: Sequence[Any]) -> None:
    """Register compiled functions for the stubs above, by the type of the plan."""
    stubs: tuple[Callable[..., None], ...] = (evaluate, moved, unitary, lifted)
    for stub, function in zip(stubs, functions, strict=True):
        _offer(plan, stub, function)


def _offer(plan: type, stub: Callable[..., None], function: Any) -> None:
    def chosen(*given: Any) -> Any:
        return function.py_func if getattr(given[0], "instance_class", None) is plan else None

    overload(stub, jit_options=function.targetoptions, strict=False)(chosen)
