"""Guides of one point of a batch of mechanisms, placed in space and checked."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import InvalidLinkage, quoted
from ...given import array, several
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
        Cylinder(),
        Cone(),
        Hyperboloid(),
        HyperboloidSinh(),
        HyperboloidAxial(),
        HyperboloidRuled(),
        Torus(),
        Sphere(),
        SphereZ(),
        Plane(),
        PlaneCartesian(),
        Circle(),
        Helix(),
        Line(),
    )
}


@dataclass(frozen=True, eq=False)
class Guides:
    """The guides of one body point in n mechanisms; with n = 1, one guide for all.

    Parameters
    ----------
    kind : str, Kind, or a sequence of n of them
        Names of `KINDS`, or a user's own kinds.
    parameters : array-like, shape (..., k)
        In the order of the kind's parameters; surplus ones are ignored.
    origin : array-like, shape (..., 3)
    quaternion : array-like, shape (..., 4)
        (s, x, y, z) of any length: world = origin + rotation (local).

    Raises
    ------
    InvalidLinkage
        If a kind is unknown, a shape is wrong, or a number is not finite or out of its domain.
    InvalidRequest
        If a kind is neither a name nor a `Kind`.
    """

    kind: Any
    parameters: Any = ()
    origin: Any = (0.0, 0.0, 0.0)
    quaternion: Any = (1.0, 0.0, 0.0, 0.0)
    kinds: tuple[Kind, ...] = field(init=False)
    which: Array = field(init=False)

    def __post_init__(self) -> None:
        one = isinstance(self.kind, str | Kind)
        named = (self.kind,) if one else several("kind", self.kind, str | Kind)
        different = list(dict.fromkeys(named))
        if not different:
            raise InvalidLinkage(f"kind must be a guide, one of {', '.join(KINDS)}")
        for unknown in different:
            if not isinstance(unknown, Kind) and unknown not in KINDS:
                raise InvalidLinkage(f"there is no guide {quoted(unknown)}; there are {', '.join(KINDS)}")
        width = max(len((k if isinstance(k, Kind) else KINDS[k]).parameters) for k in different)
        every = {
            "parameters": array("parameters", self.parameters, wrong=InvalidLinkage),
            "origin": array("origin", self.origin, (3,), (None, 3), wrong=InvalidLinkage),
            "quaternion": array("quaternion", self.quaternion, (4,), (None, 4), wrong=InvalidLinkage),
        }
        size = every["parameters"].shape
        if len(size) not in (1, 2) or not all(size[:-1]) or size[-1] < width:
            raise InvalidLinkage(f"parameters of these guides must be {width} numbers, not of shape {size}")
        sizes = {len(named), *(len(v) for v in every.values() if v.ndim == 2)} - {1}
        if len(sizes) > 1:
            many = " and ".join(map(str, sorted(sizes)))
            raise InvalidLinkage(f"guides are of {many} mechanisms: give one for all, or one for each")
        n = max(sizes, default=1)
        for name, v in every.items():
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
        """Return each kind, the indices of its guides, and their parameters (k, m)."""
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
    """Return a copy with some arrays replaced, without checks."""
    other = object.__new__(type(one))
    fields = {name: getattr(one, name) for name in one.__dataclass_fields__}
    for name, value in {**fields, **changes}.items():
        object.__setattr__(other, name, value)
    return other
