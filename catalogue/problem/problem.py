"""A request as one value, and the design problem: the request normalised to the stroke."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InvalidRequest, quoted
from ..given import positive, switch, whole
from .constraints import Constraints
from .criteria import ANSWERS, DISTINCT
from .path import CircularArc, PathRequest, StraightLine, digits
from .ranking import Ranking, weights

#: Asymmetry of regions below which they count as symmetric [strokes]: above rounding to 12
#: decimals.
EVEN = 1e-9
#: Tolerance of the search over the requested one: its grid of stations underestimates a deviation
#: by less than this margin.
SEARCH_TOLERANCE = 1 - 2e-4


@dataclass(frozen=True)
class Request:
    """All arguments of `Catalogue.find` except its starts; equal requests have equal answers.

    Parameters
    ----------
    path : StraightLine or CircularArc
        Path and tolerance; its unit is that of all lengths.
    constraints : Constraints
    rank_by : str, mapping of str to float, or sequence of str
        Kept as text with weights of sum 1, or as a tuple of the criteria of a Pareto front.
    limit, per_series, distinct, effort, refine, cognates, round_to, desires
        As in `Catalogue.find`.

    Raises
    ------
    InvalidRequest
        If a value is invalid.

    Examples
    --------
    >>> from catalogue import Request, StraightLine
    >>> asked = Request.of(StraightLine(150, 0.05, unit="mm"), families=["four-bar"], max_size=400)
    >>> asked.to_dict()["max_size"], Request.from_json(asked.to_json()) == asked
    (400.0, True)
    >>> Request.from_dict({"stroke": "15cm", "deviation": "0.05mm", "unit": "mm"}).path.stroke
    150.0
    >>> len({asked, Request.from_toml(asked.to_toml())})
    1
    """

    path: PathRequest
    constraints: Constraints = Constraints()  # noqa: RUF009  # frozen
    rank_by: Any = "score"
    limit: int = ANSWERS
    per_series: int | None = None
    distinct: float = DISTINCT
    effort: int = 1
    refine: bool = True
    cognates: bool = False
    round_to: float | None = None
    desires: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.path, PathRequest):
            raise InvalidRequest(f"find wants a StraightLine, CircularArc or Request, not {quoted(self.path)}")
        if not isinstance(self.constraints, Constraints):
            raise InvalidRequest(f"constraints must be Constraints, not {quoted(self.constraints)}")
        kept: dict[str, Any] = {"limit": whole("limit", self.limit, 1), "effort": whole("effort", self.effort, 0)}
        kept |= {name: switch(name, getattr(self, name)) for name in ("refine", "cognates")}
        kept["per_series"] = None if self.per_series is None else whole("per_series", self.per_series, 0)
        kept["round_to"] = None if self.round_to is None else positive("round_to", self.round_to)
        desires = dict(self.desires) if _is_pairs(self.desires) else self.desires
        ranking = Ranking.of(self.path, self.rank_by, kept["per_series"], self.distinct, kept["limit"], desires)
        kept["rank_by"] = ranking.front or _format_weights(ranking.weights)
        kept["distinct"] = ranking.distinct
        wishes = {name: tuple(float(part) for part in parts) for name, parts in (desires or {}).items()}
        kept["desires"] = tuple(sorted(wishes.items())) or None
        for name, value in kept.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_ranking", ranking)

    @classmethod
    def of(cls, path: PathRequest | Request, /, *, options: Iterable[str] = (), **keywords: Any) -> Request:
        """Build a request from a path and the keywords of `Catalogue.find`.

        Parameters
        ----------
        path : StraightLine, CircularArc or Request
            A request takes no keywords: `with_` changes one.
        options : iterable of str
            Further names to suggest for an unknown one.
        **keywords
            Fields of `Request` and of `Constraints`.

        Raises
        ------
        InvalidRequest
            If a value is invalid, or a name unknown.
        """
        own = {name: keywords.pop(name) for name in OWN if name in keywords}
        if not isinstance(path, Request):
            return cls(path, Constraints.of(keywords, (*OWN, *options)), **own)
        changed = [*keywords, *(name for name, value in own.items() if not is_default(name, value))]
        if changed:
            raise InvalidRequest(f"{changed[0]} stands in the request already: change it by request.with_()")
        return path

    def with_(self, **keywords: Any) -> Request:
        """Change keywords of `Catalogue.find`, or fields of the path.

        Parameters
        ----------
        **keywords
            Fields of `Request`, of `Constraints` and of the path.

        Returns
        -------
        Request

        Examples
        --------
        >>> from catalogue import Request, StraightLine
        >>> asked = Request.of(StraightLine(150, 0.05), max_size=400)
        >>> looser = asked.with_(deviation=0.1, max_size=500)
        >>> looser.path.deviation, looser.constraints.max_size
        (0.1, 500.0)
        """
        own = {name: keywords.pop(name) for name in OWN if name in keywords}
        path = {name: keywords.pop(name) for name in PATH_FIELDS if name in keywords}
        known = [one.name for one in fields(Constraints)]
        if wrong := [name for name in keywords if name not in known]:
            Constraints.of({wrong[0]: None}, (*OWN, *PATH_FIELDS))  # its message suggests similar names
        return replace(
            self,
            path=replace(self.path, **_changed_path(self.path, path)) if path else self.path,
            constraints=replace(self.constraints, **keywords) if keywords else self.constraints,
            **own,
        )

    @property
    def ranking(self) -> Ranking:
        """The ranking of answers, in strokes."""
        ranking: Ranking = vars(self)["_ranking"]
        return ranking

    @cached_property
    def problem(self) -> Problem:
        """The request in strokes, in the frame of its path."""
        return Problem.of(self.path, self.constraints, self.ranking, self.limit, self.effort)

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain numbers, texts and lists by name; defaults are left out.

        Returns
        -------
        dict
            For `from_dict`; lengths in ``unit``.
        """
        from .forms import to_dict

        return to_dict(self)

    @classmethod
    def from_dict(cls, given: Mapping[str, object]) -> Request:
        """Build a request from a mapping, or from a row of a table.

        Parameters
        ----------
        given : mapping of str to object
            Names as in `to_dict`; None, NaN and empty texts count as not given.  Values may be
            texts: lengths with a unit (``"80mm"``), lists as numbers or names separated by blanks
            or commas, zones separated by semicolons.  A name may carry a unit: ``max_size [in]``.

        Raises
        ------
        InvalidRequest
            If a name is unknown, or a value invalid.
        """
        from .forms import from_dict

        return from_dict(given)

    def to_json(self) -> str:
        """Convert to a JSON object on one line; a side at infinity is the text ``"inf"``."""
        from .forms import to_json

        return to_json(self)

    @classmethod
    def from_json(cls, text: str) -> Request:
        """Build a request from a JSON object.

        Parameters
        ----------
        text : str
            Names and values as in `from_dict`.

        Raises
        ------
        InvalidRequest
            If the text is no JSON, a name is unknown, or a value invalid.
        """
        from .forms import from_text

        return from_text("JSON", text)

    def to_toml(self) -> str:
        """Convert to TOML, a line for each name; ``catalogue find --config`` reads it too."""
        from .forms import to_toml

        return to_toml(self)

    @classmethod
    def from_toml(cls, text: str) -> Request:
        """Build a request from TOML.

        Parameters
        ----------
        text : str
            Names and values as in `from_dict`.

        Raises
        ------
        InvalidRequest
            If the text is no TOML, a name is unknown, or a value invalid.
        """
        from .forms import from_text

        return from_text("TOML", text)

    def to_row(self) -> dict[str, Any]:
        """Convert to cells of a table: numbers and texts by name; `from_dict` reads them."""
        from .forms import to_row

        return to_row(self)


#: Fields of a path.
PATH_FIELDS = ("stroke", "deviation", "radius", "angle", "start", "along", "unit")
#: Defaults of the fields of a request that are not constraints.
DEFAULTS = {one.name: one.default for one in fields(Request) if one.name not in ("path", "constraints")}
#: Names of the fields of a request that are not constraints.
OWN = (*DEFAULTS,)


def is_default(name: str, value: object) -> bool:
    default = DEFAULTS[name]
    return value is default or (type(value) is type(default) and value == default)


def _is_pairs(given: object) -> bool:
    """Tell whether desires are a tuple of pairs, as a request keeps them."""
    return isinstance(given, tuple) and all(isinstance(one, tuple) and len(one) == 2 for one in given)


def _changed_path(path: PathRequest, changes: dict[str, Any]) -> dict[str, Any]:
    """Complete a change of stroke, radius or angle of an arc: one of the other two is kept."""
    shape = ("stroke", "radius", "angle")
    changed = [name for name in shape if name in changes]
    if not isinstance(path, CircularArc) or len(changed) != 1 or (path.radius is None and changed == ["stroke"]):
        return changes
    kept = next(name for name in (("angle",) if path.is_wide else ()) + ("radius", "stroke") if name != changed[0])
    return changes | {name: None for name in shape if name not in (kept, *changed)}


def _format_weights(given: Mapping[str, float]) -> str:
    """Format weights as a text that `weights` reads back unchanged."""
    if len(given) == 1:
        return next(iter(given))
    text = ",".join(f"{name}={weight!r}" for name, weight in given.items())
    again = weights(text)
    return text if again == given else _format_weights(again)  # the sum of rounded weights may differ from 1


@dataclass(frozen=True)
class Problem:
    """A design problem: the path runs from 0 to 1, lengths are in strokes.

    Beyond a half circle, where the chord becomes short again, lengths are in diameters, and the
    path ends at `path.stroke`.  The user's unit, position and direction enter once, in `of`.
    Search, refinement and selection do not depend on them, so a scaled or moved request has the
    same answers.
    """

    path: PathRequest  # path of stroke 1
    constraints: Constraints
    ranking: Ranking
    limit: int  # maximum number of answers
    effort: int  # multiple of the usual search time; 0: only the first list
    scale: complex  # z -> scale z + shift maps the path to the user's frame
    shift: complex
    #: Objective in place of the ranking: minimise the violation of this constraint, or of
    #: ``deviation``, subject to the others; ``ranking``: only satisfy all constraints.
    relaxed: str = ""
    #: Whether the requested path itself is the nominal, instead of the best-fitting one: with
    #: prescribed pivots.
    in_place: bool = False

    @classmethod
    def of(
        cls, request: PathRequest, constraints: Constraints, ranking: Ranking, limit: int = ANSWERS, effort: int = 1
    ) -> Problem:
        """Normalise a request in the user's unit."""
        scale, shift = request.extent * request.direction, request.origin
        path: PathRequest = StraightLine(1.0, digits(request.relative))
        if isinstance(request, CircularArc):
            radius = None if request.radius is None else digits(request.radius / request.stroke)
            path = CircularArc(1.0, digits(request.relative), radius)
            # the angle determines the arc more precisely than the chord, which follows from it
            if request.is_wide and request.angle and request.radius:
                radius, angle = digits(request.radius / request.extent), digits(request.angle)
                path = CircularArc(deviation=digits(request.relative), radius=radius, angle=angle)
        if constraints.returns:
            ranking = ranking.without("allowance")
        carried, fixed = constraints.carried(1 / scale, -shift / scale), constraints.given is not None
        return cls(path, carried, ranking, limit, effort, scale, shift, in_place=fixed)

    @property
    def mirrors(self) -> tuple[bool, bool]:
        """Mirrors of the problem to search: at mid-path and, for a line, in the line.

        They move the regions to the left and below, so that mirror images of a problem have the
        same answers.
        """
        middle = (0.5 * self.path.stroke, 0.0)
        corners = np.array([region.corners.mean(0) - middle for region in self.constraints.regions]).reshape(-1, 2)
        right, above = corners.sum(0) > EVEN
        return bool(right), bool(above and not self.curved)

    def mirrored(self, reverse: bool, over: bool) -> Problem:
        """Mirror the regions of the problem at mid-path and in the line of the path."""
        return replace(self, constraints=self.constraints.mirrored(reverse, over, self.path.stroke))

    def with_constraints(self, **changes: Any) -> Problem:
        """Replace some constraints [strokes]."""
        return replace(self, constraints=replace(self.constraints, **changes))

    def tightened(self) -> Problem:
        """Return the problem with the tolerance of the search, slightly below the requested one."""
        return replace(self, path=replace(self.path, deviation=self.deviation * SEARCH_TOLERANCE))

    @property
    def deviation(self) -> float:
        """Largest permitted deviation [strokes]."""
        return self.path.deviation

    @property
    def curved(self) -> bool:
        """Whether the nominal is an arc."""
        return self.path.kind == "circle"

    @cached_property
    def curvature(self) -> float | None:
        """Curvature of the nominal, negative for a centre below it.

        0 for a line, None for any radius.
        """
        radius = self.path.radius
        return None if radius is None else -1 / radius + 0.0

    @property
    def is_wide(self) -> bool:
        """Whether the nominal is an arc measured by its angle."""
        return self.path.is_wide

    @property
    def fixed_curvature(self) -> float | None:
        """Curvature of an arc of given radius; None for a line and for an arc of any radius."""
        return self.curvature if self.curved else None

    @property
    def needs_allowance(self) -> bool:
        """Whether a constraint or the ranking involves the allowance."""
        return bool(self.constraints.min_allowance) or "allowance" in self.ranking.quantities

    @property
    def zone(self) -> tuple[bool, int]:
        """Type of the zone: whether it is circular, and the number of its fitted coordinates.

        No coordinate is fitted for a prescribed nominal, two for a line or an arc of given radius,
        else three.
        """
        return self.curved, 0 if self.in_place else 3 if self.curvature is None else 2

    @property
    def stroke(self) -> float:
        """Unit of the problem in the user's unit: the stroke, beyond a half circle the diameter."""
        return abs(self.scale)
