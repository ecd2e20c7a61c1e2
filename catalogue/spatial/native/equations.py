"""Interface of compiled equations to `newton` and `curve`.

A kernel registers its functions for the type of its plan.  numba selects them by the type of the
first argument, and compiles their callers once for each type.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from numba.extending import overload


def evaluate(plan: Any, geometry: Any, g: int, y: Any, w: Any, jacobian: bool) -> None:
    """Compute conditions, then the drive; with `jacobian`, their Jacobian too."""


def moved(plan: Any, y: Any, step: Any) -> None:
    """Move a state by a step of all unknowns, in place."""


def unitary(plan: Any, y: Any) -> None:
    """Normalise quaternions, in place."""


def lifted(plan: Any, y: Any, step: Any, out: Any) -> None:
    """Compute the rates of a state from the rates of the unknowns."""


def offer(plan: type, functions: Sequence[Any]) -> None:
    """Register compiled functions for these stubs, by the type of the plan."""
    stubs: tuple[Callable[..., None], ...] = (evaluate, moved, unitary, lifted)
    for stub, function in zip(stubs, functions, strict=True):
        _register(plan, stub, function)


def _register(plan: type, stub: Callable[..., None], function: Any) -> None:
    def chosen(*given: Any) -> Any:
        return function.py_func if getattr(given[0], "instance_class", None) is plan else None

    overload(stub, jit_options=function.targetoptions, strict=False)(chosen)
