"""Guides of one point of a batch of mechanisms, of any kinds, placed in space and checked when they are made."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import InvalidLinkage
from ...kinematics.types import Array
from .curves import Circle, Helix, Line
from .kinds import Kind
from .surfaces import (
    Cone,
    Cylinder,
    Hyperboloid,
    HyperboloidAxial,
    HyperboloidRuled,
    HyperboloidSinh,
    Plane,
    PlaneCartesian,
    Sphere,
    SphereZ,
    Torus,
)

#: Every kind of guide by name.
KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Cylinder(), Cone(), Hyperboloid(), HyperboloidSinh(), HyperboloidAxial(), HyperboloidRuled(), Torus(),
        Sphere(), SphereZ(), Plane(), PlaneCartesian(), Circle(), Helix(), Line(),
    )
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Guides:
    """The guides of one point of the body, of n mechanisms; of one for all if n = 1.

    Parameters
    ----------
    kind : str, Kind, or a sequence of n of them
        Names of `KINDS`, or kinds of one's own.
    parameters : array-like, shape (..., k)
        In the order of the kind's; those beyond its number are ignored.
    origin : array-like, shape (..., 3)
    quaternion : array-like, shape (..., 4)
        (s, x, y, z) of any length: world = origin + rotation (local).

    Raises
    ------
    InvalidLinkage
        If a kind is unknown, or a number is not finite or out of its domain.
    """

    kind: Any
    parameters: Any = ()
    origin: Any = (0.0, 0.0, 0.0)
    quaternion: Any = (1.0, 0.0, 0.0, 0.0)
    kinds: tuple[Kind, ...] = field(init=False)
    which: Array = field(init=False)

    def __post_init__(self) -> None:
        named = [self.kind] if isinstance(self.kind, str | Kind) else list(self.kind)
        different = list(dict.fromkeys(named))
        for name in different:
            if not isinstance(name, Kind) and name not in KINDS:
                raise InvalidLinkage(f"there is no guide {name!r}; there are {', '.join(KINDS)}")
        width = max(len((k if isinstance(k, Kind) else KINDS[k]).parameters) for k in different)
        arrays = [np.asarray(v, float) for v in (self.parameters, self.origin, self.quaternion)]
        n = max(len(named), *(len(v) if v.ndim == 2 else 1 for v in arrays))
        for name, v, w in zip(("parameters", "origin", "quaternion"), arrays, (width, 3, 4), strict=True):
            if v.shape[-1] < w or (w > 2 and v.shape[-1] != w and name != "parameters"):
                raise InvalidLinkage(f"the {name} of a guide {different[0]!r} must be {w} numbers, not {v.shape[-1]}")
            object.__setattr__(self, name, np.broadcast_to(v, (n, v.shape[-1])))
        number = {name: i for i, name in enumerate(different)}
        object.__setattr__(self, "which", np.broadcast_to([number[k] for k in named], (n,)))
        object.__setattr__(self, "kinds", tuple(k if isinstance(k, Kind) else KINDS[k] for k in different))
        for c, kind in enumerate(self.kinds):
            here = self.which == c
            p = self.parameters[here, : len(kind.parameters)].T
            wrong = ~(np.isfinite(p).all(0) & kind.valid(np.where(np.isfinite(p), p, 1)))
            placed = np.isfinite(self.origin[here]).all(1) & np.isfinite(self.quaternion[here]).all(1)
            wrong |= ~placed | (self.quaternion[here] == 0).all(1)
            if wrong.any():
                i = np.flatnonzero(here)[wrong.argmax()]
                shape = ", ".join(f"{k} = {v:g}" for k, v in zip(kind.parameters, self.parameters[i], strict=False))
                raise InvalidLinkage(
                    f"guide {i} is no {kind.name}: {shape or 'its place'}, origin {self.origin[i].tolist()}, "
                    f"quaternion {self.quaternion[i].tolist()}; give finite numbers in their domain"
                )

    def __len__(self) -> int:
        return len(self.which)

    def __getitem__(self, index: Any) -> Guides:
        names = ("which", "parameters", "origin", "quaternion")
        selected: Guides = same(self, {name: getattr(self, name)[index] for name in names})
        return selected

    def each(self) -> list[tuple[Kind, Array, Array]]:
        """Return each kind that there is, whose guides they are, and their parameters (k, m)."""
        return self._each

    @cached_property
    def _each(self) -> list[tuple[Kind, Array, Array]]:
        found = []
        for c, kind in enumerate(self.kinds):
            index = np.flatnonzero(self.which == c)
            if len(index):
                found.append((kind, index, self.parameters[index, : len(kind.parameters)].T))
        return found


def same(one: Any, changes: dict[str, Any]) -> Any:
    """Return a copy with other arrays that need no check, as they are a selection of checked ones."""
    other = object.__new__(type(one))
    fields = {name: getattr(one, name) for name in one.__dataclass_fields__}
    for name, value in {**fields, **changes}.items():
        object.__setattr__(other, name, value)
    return other
