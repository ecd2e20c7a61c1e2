"""Definition of a collection: mechanisms that guide points, other than linkages of two dyads.

How to write a plugin that adds a collection:

1. Write `draw(family, rng, count)`: draw `count` mechanisms of a family and return a `Specimen`
   for each thing they guide.  Parameters are plain numbers, texts, lists and dicts, in units of
   their own.
2. Write `measure(parameters, request)`: place each mechanism along the requested path, follow its
   finite motion, and return `Measured` results.
3. Write `classify(parameters)` and `plot(candidate, file)`; if you can, `refine(parameters,
   request, goal)`, and `starts(pivots, point, request)` of mechanisms made of four-bars.
4. Put them in a `Collection` and return it from the hook ``catalogue_collections``, whose body
   imports what it needs: the hook is called only when a collection is asked for.
5. Run the contract tests: subclass `catalogue.testing.CollectionContract`.

Drawing in blocks, storing, bounding, ranking, verifying and printing belong to the core.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsFloat

import numpy as np

from ..errors import PluginError, quoted
from ..foreign_code import checked_name, checked_text
from ..kinematics.batch import Rows
from ..kinematics.types import Complexes, Floats
from .goal import Goal

if TYPE_CHECKING:
    from ..problem.path import PathRequest
    from .results import CollectionCandidate

#: JSON objects that describe a mechanism completely.
Parameters = Mapping[str, Any]

#: Unit of a metric that is a length: stored in strokes, answered in the user's unit.
LENGTH = "length"
#: Columns of every answer: no metric may have these names.
COLUMNS = (
    *("id", "collection", "family", "series", "configuration", "special"),
    *("stroke", "deviation", "radius", "unit", "parameters"),
)
#: Kinds of nominal that a request can ask for.
KINDS = ("line", "circle")


@dataclass(frozen=True)
class Metric:
    """A number stored for each specimen, which may be bounded and ranked by.

    Parameters
    ----------
    meaning : str
    unit : str
        `LENGTH`, or any other text ("deg", "1").
    more : bool
        Whether larger values are better.
    minor : bool
        Whether tables omit it unless it is bounded or ranked.
    """

    meaning: str
    unit: str
    more: bool = False
    minor: bool = False


@dataclass(frozen=True)
class Specimen:
    """A mechanism with a guided element, as it is stored.

    Parameters
    ----------
    family, series, configuration : str
        Family and series are declared by the collection; the configuration is free.
    kind : str
        ``line`` or ``circle``.
    deviation : float
        Deviation of the guided path from the nominal [strokes].
    parameters : mapping
    metrics : mapping
        Values of all declared metrics; lengths in strokes.

    Raises
    ------
    PluginError
        If a tag is blank, a number is not finite, or the parameters cannot be stored as JSON.
    """

    family: str
    series: str
    configuration: str
    kind: str
    deviation: float
    parameters: Parameters
    metrics: Mapping[str, float]

    def __post_init__(self) -> None:
        what = f"a specimen of {self.family} {self.series}"
        if not (self.family and self.series and self.configuration):
            raise PluginError(f"{what}: family, series and configuration must not be blank")
        if self.kind not in KINDS:
            raise PluginError(f"{what}: its kind must be one of {', '.join(KINDS)}, not {self.kind!r}")
        if not 0 <= self.deviation < math.inf:
            raise PluginError(f"{what}: its deviation must be a finite number, not {self.deviation}")
        wrong = [name for name, value in self.metrics.items() if not math.isfinite(value)]
        if wrong:
            raise PluginError(f"{what}: {wrong[0]} must be a finite number, not {self.metrics[wrong[0]]}")
        try:
            json.dumps(dict(self.parameters), allow_nan=False)
        except (TypeError, ValueError) as error:
            raise PluginError(f"{what}: its parameters are no JSON: {error}") from None


@dataclass(frozen=True)
class Places(Rows):
    """Places of planar mechanisms over their strokes, along +x from the origin [length].

    Parameters
    ----------
    fixed : complex ndarray, shape (k,), or (n, k) of n mechanisms
        Joints of the frame, and ends of its rails over the stroke.
    joints : complex ndarray, shape (m, j), or (n, m, j)
        All joints at m positions from one end of the path to the other.
    bars : complex ndarray, shape (m, s, 2), or (n, m, s, 2)
        Ends of segments that cover the moving bars.
    """

    fixed: Complexes
    joints: Complexes
    bars: Complexes


@dataclass(frozen=True)
class Measured:
    """Measures of a mechanism on its finite motion over the requested stroke.

    Parameters
    ----------
    deviation : float
        Largest distance from the path; from the best-placed arc of the radius where one is given.
        NaN if the mechanism cannot be placed [length].
    radius : float or None
        Radius of the arc, given or fitted; None for a line [length].
    metrics : mapping
        Values by the names of the metrics, lengths in the user's unit.
    parameters : mapping
        The placed mechanism, its path from the origin along +x, lengths in the user's unit.
    reason : str
        Reason why the mechanism cannot be placed, if the deviation is NaN.
    places : Places, optional
        Joints and bars of a planar mechanism, to be tested against regions.
    """

    deviation: float
    radius: float | None
    metrics: Mapping[str, float]
    parameters: Parameters
    reason: str = ""
    places: Places | None = field(default=None, repr=False)

    @staticmethod
    def no(reason: str) -> Measured:
        """Return the measures of a mechanism that cannot be placed: NaN, with the reason."""
        return Measured(math.nan, None, {}, {}, reason)


@dataclass(frozen=True)
class Tags:
    """Series, family and configuration of a mechanism; `special` names its well-known cases."""

    family: str
    series: str
    configuration: str
    special: tuple[str, ...] = ()


Draw = Callable[[str, np.random.Generator, int], Sequence[Specimen]]
Measure = Callable[[Sequence[Parameters], "PathRequest"], Sequence[Measured]]
Classify = Callable[[Parameters], Tags]
Starts = Callable[[Floats, Complexes, "PathRequest"], Sequence[Parameters]]
Refine = Callable[[Sequence[Parameters], "PathRequest", Goal], Sequence[Parameters | None]]
Plot = Callable[["CollectionCandidate", Path | None], Any]
Mechanism = Callable[["CollectionCandidate"], tuple[Mapping[str, Any], tuple[float, float]]]


@dataclass(frozen=True)
class Collection:
    """A kind of mechanisms: data and four functions.

    Parameters
    ----------
    name : str
        Lower-case words with hyphens.
    title, source : str
        Title of the collection, and source of its mechanisms.
    plan : str
        Name of the sampling method; specimens sampled by another method are replaced.
    families : mapping of str to sequence of str
        The series of each family.
    metrics : mapping of str to Metric
        The metrics by name. One named ``sweep`` is the stroke over the radius: it narrows the
        retrieval for a given radius.
    draw, measure, classify, plot
        See the head of the module.
    origin : str
        File or package it comes from, as the registry notes it.
    special : mapping of str to sequence of str
        Names that `classify` gives to well-known cases, each with the configurations that they may
        have, ``*`` for any text: others are left out before any is classified.
    refine : callable, optional
        Takes parameters of placed mechanisms, a request and a `Goal`; returns for each the
        parameters of a better mechanism nearby, or None. They are then measured and checked.
    starts : callable, optional
        Takes four-bars that answer a request, and the request; returns parameters of mechanisms
        made of them. The four-bars are pivots (n, 2, 2, 3), for each crank the fixed and the moving
        one at mid-stroke, and guided points (n,), complex.
    seeds : callable, optional
        Like `starts`, of mechanisms from which `refine` starts.
    mechanism : callable, optional
        For planar mechanisms of many bars: takes an answer; returns data of `catalogue.mechanism`,
        placed along the requested path, and the phases at which the path starts and ends [rad].
        Answers are then measured, traced and exported like a user's own mechanism.
    pinned : sequence of str, optional
        Families whose joints are all pins; None if that is not known.
    near : int
        Number of stored specimens of each family that `refine` starts from if they do not suffice.
    specimens : int
        Number of specimens sampled on first use.
    block : int
        Number of mechanisms sampled at once.

    Raises
    ------
    PluginError
        If data are missing or contradict one another.
    """

    name: str
    title: str
    source: str
    plan: str
    families: Mapping[str, Sequence[str]]
    metrics: Mapping[str, Metric]
    draw: Draw
    measure: Measure
    classify: Classify
    plot: Plot
    origin: str = ""
    special: Mapping[str, Sequence[str]] = field(default_factory=dict)
    refine: Refine | None = None
    starts: Starts | None = None
    seeds: Starts | None = None
    mechanism: Mechanism | None = None
    pinned: Sequence[str] | None = None
    near: int = 0
    specimens: int = 3000
    block: int = 192

    def __post_init__(self) -> None:
        what = f"collection {self.name!r}"
        if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", self.name):
            raise PluginError(f"{what}: the name must be lower-case words with hyphens")
        if not (self.title.strip() and self.source.strip() and self.plan.strip()):
            raise PluginError(f"{what}: title, source and plan must not be blank")
        if not self.families or not all(f and series and all(series) for f, series in self.families.items()):
            raise PluginError(f"{what}: it needs families, and each of them series")
        for text in (*self.families, *self.series):
            checked_name(f"a family or series of {what}", text)
        for text in (self.title, self.source, self.plan, *self.special):
            checked_text(f"title, source or plan of {what}", text)
        for name, metric in self.metrics.items():
            if not re.fullmatch(r"[a-z]\w*", name) or name in COLUMNS:
                raise PluginError(f"{what}: a metric cannot be called {name!r}")
            if not isinstance(metric, Metric) or not (metric.meaning.strip() and metric.unit.strip()):
                raise PluginError(f"{what}: say what the metric {name} means and its unit ('1' if none)")
        for name in ("draw", "measure", "classify", "plot"):
            if not callable(getattr(self, name)):
                raise PluginError(f"{what}: {name} must be a function")
        if not all(isinstance(number, int) and number > 0 for number in (self.specimens, self.block)):
            raise PluginError(f"{what}: specimens and block must be positive whole numbers")
        for name in ("refine", "starts", "seeds", "mechanism"):
            if getattr(self, name) is not None and not callable(getattr(self, name)):
                raise PluginError(f"{what}: {name} must be a function")

    @property
    def series(self) -> list[str]:
        """All series, each once, in order."""
        return list(dict.fromkeys(code for series in self.families.values() for code in series))

    def measures(self, one: Measured) -> None:
        """Check that a measurement has all metrics, as numbers, or a reason.

        Raises
        ------
        PluginError
            If not.
        """
        if not isinstance(one, Measured):
            raise PluginError(f"measure gave {type(one).__name__} where Measured is wanted")
        if one.reason:
            checked_text("a reason", one.reason)
            return
        wanted = {"deviation": one.deviation, **{name: one.metrics.get(name) for name in self.metrics}}
        for name, value in wanted.items():
            if not isinstance(value, SupportsFloat) or not math.isfinite(value):
                raise PluginError(f"{name} must be a finite number, not {quoted(value)}")
        json.dumps(dict(one.parameters), allow_nan=False)

    def owns(self, specimen: Specimen) -> None:
        """Check that a specimen has the declared tags and metrics.

        Raises
        ------
        PluginError
            If not.
        """
        if not isinstance(specimen, Specimen):
            raise PluginError(f"draw gave {type(specimen).__name__} where Specimen is wanted")
        checked_text("configuration of a specimen", specimen.configuration, 100)
        if specimen.series not in self.families.get(specimen.family, ()):
            raise PluginError(
                f"collection {self.name}: a specimen is of {specimen.family} {specimen.series}, undeclared"
            )
        if specimen.metrics.keys() != self.metrics.keys():
            odd = sorted(specimen.metrics.keys() ^ self.metrics.keys())
            raise PluginError(
                f"collection {self.name}: the metrics of a specimen and the declared ones differ in {odd}"
            )
