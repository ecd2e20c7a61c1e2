"""Definition of a family of mechanisms of many bars.

How to write a plugin that adds families:

1. State the bars by their joints, the drive, and slides, gears or bars kept parallel, if any, in
   `Structure.of`.  The core finds the groups in which the bars close.
2. State the free `parameters`, each with its domain, and write `pose(p)`: from arrays (n,) by name
   to the positions of all joints in one pose, complex, shape () or (n,).  `apex` places a joint by
   two distances, as in a table of lengths.
3. If there are slides, write `directions(p)`, a complex vector along each. 4. If the family has
well-known cases, name them in `special`, each with a test of its parameters. 5. If it is made of
four-bars, write `from_four_bars(b, c, p)`, the parameters of mechanisms made of
   four-bars on fixed pivots 0 and 1: requests are answered from the planar guides, too.
6. Put it all in a `ChainFamily`, some of these in `chain_collection`, and return that from the hook
   ``catalogue_collections``.
7. Run the contract tests: subclass `catalogue.testing.CollectionContract`.

Drawing samples, following circuits, finding and measuring stretches, storing, bounding, ranking,
refining and drawing belong to the core.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..chains.chain import Chain
from ..chains.structure import Structure
from ..errors import InvalidLinkage, PluginError, quoted
from ..foreign_code import checked_name, checked_text
from ..kinematics.types import Complexes, Floats, Mask
from .series import Parameter

#: Columns of parameters by name, of n mechanisms.
Columns = Mapping[str, Floats]


def no_directions(p: Columns) -> Sequence[Any]:  # noqa: ARG001
    """Return the directions of no slides."""
    return ()


#: Maps four-bars (n,), as crank pins, rocker pins and guided points, to parameters by name.
FromFourBars = Callable[[Complexes, Complexes, Complexes], Columns]


@dataclass(frozen=True)
class ChainFamily:
    """A family of mechanisms of many bars: data and one formula.

    Parameters
    ----------
    name : str
        Lower-case words with hyphens, such as ``watt-1``.
    title, source : str
        Title of the family, and source of the mechanism.
    structure : Structure
        Bars, joints and drive.
    point : str
        The guided joint.
    parameters : sequence of Parameter
        Free parameters with their domains.
    pose : callable
        Maps parameters (n,) by name to positions by joint, complex.
    directions : callable
        Maps parameters to a complex vector along each slide.
    exact : bool
        Whether the point runs exactly along a line or circle.
    special : mapping of str to callable
        Names of well-known cases, each with a test of the parameters of one mechanism.
    from_four_bars : callable, optional
        Maps four-bars (n,) to parameters by name. Arguments are the crank pin, the rocker pin (left
        of the line from the crank pin to the fixed pivot of the rocker) and the guided point,
        complex, with the fixed pivots of crank and rocker at 0 and 1. The mechanism has the scale
        of the four-bar, and the same path.
    seeds : callable, optional
        Like `from_four_bars`, of mechanisms whose further bars move idly; there may be several of
        each four-bar, in turn.  Refinement starts from them.

    Raises
    ------
    PluginError
        If data are missing or contradict one another; one line says which.
    """

    name: str
    title: str
    source: str
    structure: Structure
    point: str
    parameters: Sequence[Parameter]
    pose: Callable[[Columns], Mapping[str, Any]]
    directions: Callable[[Columns], Sequence[Any]] = no_directions
    exact: bool = False
    special: Mapping[str, Callable[[Mapping[str, float]], bool]] = field(default_factory=dict)
    from_four_bars: FromFourBars | None = None
    seeds: FromFourBars | None = None

    def __post_init__(self) -> None:
        checked_name("a family of mechanisms", self.name)
        what = f"family {self.name}"
        checked_text(f"title of the {what}", self.title)
        checked_text(f"source of the {what}", self.source)
        if not isinstance(self.structure, Structure):
            raise PluginError(f"{what}: its structure must be made by Structure.of")
        if self.point not in self.structure.joints:
            raise PluginError(f"{what}: the guided point {quoted(self.point)} is no joint on a bar")
        if self.structure.frame in self.structure.on[self.guided]:
            raise PluginError(f"{what}: the guided point {quoted(self.point)} is on the frame, which stands still")
        if not all(isinstance(one, Parameter) for one in self.parameters):
            raise PluginError(f"{what}: its parameters must be of the class Parameter")
        names = [one.name for one in self.parameters]
        if len({*names}) < len(names):
            raise PluginError(f"{what}: two parameters have one name")
        functions = {"pose": self.pose, "directions": self.directions, **self.special}
        made = {"from_four_bars": self.from_four_bars, "seeds": self.seeds}
        functions |= {name: function for name, function in made.items() if function is not None}
        for name, function in functions.items():
            checked_text(f"name of a case of the {what}", name)
            if not callable(function):
                raise PluginError(f"{what}: {name} must be a function")
        try:
            self.placed(self.spread(np.full((2, len(names)), 0.5)))
        except (InvalidLinkage, LookupError, TypeError, ValueError) as error:
            raise PluginError(f"{what}: pose or directions fail in the middle of the domain: {error}") from None

    @property
    def series(self) -> str:
        """Name of its series: ``exact`` or ``approximate``."""
        return "exact" if self.exact else "approximate"

    @property
    def guided(self) -> int:
        """Number of the guided joint."""
        return self.structure.joints.index(self.point)

    @property
    def bar(self) -> int:
        """Number of a bar that carries the guided joint."""
        return min(self.structure.on[self.guided])

    def spread(self, shares: Floats) -> dict[str, Floats]:
        """Map shares of the domains, shape (n, number of parameters), to parameters."""
        return {one.name: one.spread(shares[:, i]) for i, one in enumerate(self.parameters)}

    def chains(self, p: Columns) -> tuple[Chain, Mask]:
        """Make chains from parameters (n,); return the valid ones and their mask (n,)."""
        return Chain.valid(self.structure, *self.placed(p))

    def placed(self, p: Columns) -> tuple[Complexes, Complexes]:
        """Return the positions of joints (j, n) and the directions of slides (s, n)."""
        n = len(next(iter(p.values()), np.zeros(1)))
        with np.errstate(all="ignore"):
            joints, along = self.pose(p), self.directions(p)
        if missing := [name for name in self.structure.joints if name not in joints]:
            raise InvalidLinkage(f"joint {quoted(missing[0])} has no position")
        if len(along) != len(self.structure.slides):
            raise InvalidLinkage(f"{len(self.structure.slides)} slides need as many directions, not {len(along)}")
        z, u = (np.empty((len(values), n), complex) for values in (self.structure.joints, along))
        for row, name in zip(z, self.structure.joints, strict=True):
            row[:] = joints[name]
        for row, direction in zip(u, along, strict=True):
            row[:] = direction
        with np.errstate(all="ignore"):
            return z, np.asarray(u / np.abs(u))


def apex(one: Any, first: Any, other: Any, second: Any) -> Complexes:
    """Place joints at distances from two others, left of the line between them.

    Parameters
    ----------
    one, other : complex array_like, shape () or (n,)
    first, second : array_like, shape () or (n,)
        Distances from these joints; NaN where the circles do not meet.

    Examples
    --------
    >>> apex(0, 5, 6, 5).item()
    (3+4j)
    """
    way = np.asarray(other, complex) - one
    apart = np.abs(way)
    with np.errstate(all="ignore"):
        along = 0.5 * (apart + (first - second) * (first + second) / apart)
        square = (first - along) * (first + along)
        return np.asarray(one + way / apart * (along + 1j * np.sqrt(np.where(square < 0, np.nan, square))))
