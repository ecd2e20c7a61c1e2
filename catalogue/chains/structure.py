"""Structure of a chain: bars, joints, and the groups in which the bars close.

The joints on it define a bar.  A joint on several bars is a pin, a joint on one bar a point of
it. From the drive on, bars close in groups:

=====  ===================================================  =======================
group  bars                                                 closed by
=====  ===================================================  =======================
RRR    two, on three pins                                   triangle
RRP    a rod, and a slider on a known bar                   circle and line
RPR    two that slide on each other, on two pins            line at a distance
PRP    two sliders on known bars, on one pin                two lines
RPP    a slider on a known bar, and one that slides on it,  two lines
       pinned to a known bar
turn   one, pinned to a known bar, that turns in            rotation: a gear, or a
       proportion to known bars                             bar kept parallel
=====  ===================================================  =======================

Source: L. W. Assur's groups of class II; J. J. Uicker, G. R. Pennock, J. E. Shigley, Theory of
Machines and Mechanisms, 2003, ch. 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from math import isfinite, lcm
from typing import Any

from ..errors import InvalidLinkage, quoted
from ..foreign_code import NAME

#: Name of the fixed bar.
FRAME = "frame"
RRR = "RRR"
RRP = "RRP"
RPR = "RPR"
PRP = "PRP"
RPP = "RPP"


class Most(IntEnum):
    """Limits of a chain: number of bars, teeth of a wheel, turns of the drive.

    Gear ratios are quotients of numbers of teeth.  The drive turns until all wheels have returned
    to their start; each of these turns is searched for dead points.
    """

    BARS = 40
    TEETH = 360
    TURNS = 1000


@dataclass(frozen=True)
class Slide:
    """Bar `second` slides along bar `first`, without turning on it."""

    first: str
    second: str

    @property
    def ends(self) -> tuple[str, str]:
        """Names of both bars."""
        return self.first, self.second


@dataclass(frozen=True)
class Gear:
    """Wheels `first` and `second`, pinned to a carrier, turn in a ratio relative to it.

    The angle of `second` is `ratio` times that of `first`: negative for an external pair, and a
    quotient of two numbers of teeth, up to 360.  A bar kept parallel to another is a gear of ratio
    1 on that other.
    """

    first: str
    second: str
    carrier: str
    ratio: float


@dataclass(frozen=True)
class Link:
    """Connection of a bar with a known one: the pin or slide, by number, and the known bar."""

    is_slide: bool
    joint: int
    to: int


@dataclass(frozen=True)
class Dyad:
    """Bars `first` and `second`, on known ones by `outer` and on each other by joint `inner`."""

    kind: str
    first: int
    second: int
    outer: tuple[Link, Link]
    inner: int


@dataclass(frozen=True)
class Turn:
    """Bar `bar`, pinned to a known one, that turns by powers of known turns."""

    bar: int
    pin: Link
    gear: Gear
    wheel: int
    carrier: int


@dataclass(frozen=True)
class Structure:
    """Bars and joints of a chain, its drive, and the groups in closing order.

    Parameters
    ----------
    bars : tuple of (str, tuple of str)
        Name of each bar and of the joints on it; one bar is `frame`.
    slides : tuple of Slide
    gears : tuple of Gear
    drive : str
        A bar pinned to the frame, which turns, or a slider on the frame, which is pushed.

    Raises
    ------
    InvalidLinkage
        If a name is unknown or given twice, bars close in no group, or a gear ratio is no quotient
        of teeth or brings the wheels back only after more than 1000 turns of the drive.

    Examples
    --------
    >>> four_bar = Structure.of(
    ...     {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}, drive="crank"
    ... )
    >>> [group.kind for group in four_bar.groups], four_bar.joints
    (['RRR'], ('A', 'D', 'B', 'C', 'P'))
    """

    bars: tuple[tuple[str, tuple[str, ...]], ...]
    slides: tuple[Slide, ...]
    gears: tuple[Gear, ...]
    drive: str

    @classmethod
    def of(
        cls,
        bars: Mapping[str, Iterable[str]],
        *,
        drive: str,
        slides: Iterable[Sequence[str]] = (),
        gears: Iterable[Sequence[Any]] = (),
        parallel: Iterable[Sequence[str]] = (),
    ) -> Structure:
        """Make a structure of plain data.

        Parameters
        ----------
        bars : mapping of str to iterable of str
            Joints on each bar.
        drive : str
        slides : iterable of (str, str)
            A bar and the bar that slides along it.
        gears : iterable of (str, str, str, float)
            Two wheels, their carrier and the ratio; see `Gear`.
        parallel : iterable of (str, str)
            A bar and the bar that is kept parallel to it.
        """
        kept = [Gear(other, bar, other, 1.0) for other, bar in parallel]
        return cls(
            tuple((name, tuple(joints)) for name, joints in bars.items()),
            tuple(Slide(*one) for one in slides),
            (*(Gear(*one) for one in gears), *kept),
            drive,
        )

    def __post_init__(self) -> None:
        names = self.names
        for name in (*names, *self.joints):
            if not NAME.fullmatch(name):
                raise InvalidLinkage(
                    f"names have up to 40 of the characters A-Z a-z 0-9 . * + ' - _, unlike {quoted(name)}"
                )
        if FRAME not in names:
            raise InvalidLinkage(f"one bar must be `{FRAME}`, the one that stands still")
        if len(names) > Most.BARS:
            raise InvalidLinkage(f"{len(names)} bars are too many: at most {Most.BARS}")
        for name, joints in self.bars:
            if len({*joints}) < len(joints):
                raise InvalidLinkage(f"bar {quoted(name)} names a joint twice")
        pairs = [(one.first, one.second) for one in self.slides] + [(one.first, one.second) for one in self.gears]
        for first, second in pairs:
            if self.number(first) == self.number(second):
                raise InvalidLinkage(f"bar {quoted(first)} cannot slide or roll on itself")
        for gear in self.gears:
            if gear.ratio != 1:
                self._check_gear(gear)
        self.number(self.drive)
        _ = self.groups, self.turns

    def _check_gear(self, gear: Gear) -> None:
        if not (isfinite(gear.ratio) and gear.ratio):
            raise InvalidLinkage(f"a gear ratio must be a finite number other than zero, not {gear.ratio:g}")
        carrier = self.number(gear.carrier)
        for wheel in (self.number(gear.first), self.number(gear.second)):
            if wheel != carrier and not any({wheel, carrier} <= bars for bars in self.on):
                raise InvalidLinkage(
                    f"the wheel {quoted(self.names[wheel])} must be pinned to its carrier {quoted(gear.carrier)}"
                )

    def number(self, name: str) -> int:
        """Return the number of a bar."""
        if name not in self.names:
            raise InvalidLinkage(f"there is no bar {quoted(name)}; there are {', '.join(self.names)}")
        return self.names.index(name)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the bars."""
        return tuple(name for name, _ in self.bars)

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(dict.fromkeys(joint for _, joints in self.bars for joint in joints))

    @cached_property
    def on(self) -> tuple[frozenset[int], ...]:
        """Numbers of the bars on each joint."""
        return tuple(frozenset(i for i, (_, joints) in enumerate(self.bars) if name in joints) for name in self.joints)

    @property
    def frame(self) -> int:
        """Number of the frame."""
        return self.names.index(FRAME)

    @cached_property
    def driver(self) -> tuple[int, Link]:
        """Number of the driving bar, and its connection with the frame."""
        bar = self.number(self.drive)
        links = self._links(bar, {self.frame})
        if len(links) != 1:
            raise InvalidLinkage(
                f"the drive {quoted(self.drive)} must share one joint with the frame, or slide on it, not {len(links)}"
            )
        return bar, links[0]

    @cached_property
    def arm(self) -> list[int]:
        """Joints of a driving crank, without its fixed pin; empty if it drives a wheel."""
        bar, link = self.driver
        if link.is_slide or any(self.drive in (gear.first, gear.second) for gear in self.gears):
            return []
        return [j for j, bars in enumerate(self.on) if bar in bars and j != link.joint]

    @property
    def is_pushed(self) -> bool:
        """Whether the drive is a slider."""
        return self.driver[1].is_slide

    @cached_property
    def freedoms(self) -> int:
        """Number of freedoms by Grübler's count."""
        pins = sum(len(bars) - 1 for bars in self.on)
        return 3 * (len(self.bars) - 1) - 2 * (pins + len(self.slides)) - len(self.gears)

    @cached_property
    def groups(self) -> tuple[Dyad | Turn, ...]:
        """Groups in the order in which they close."""
        known = {self.frame, self.driver[0]}
        found = list[Dyad | Turn]()
        while len(known) < len(self.bars):
            group: Dyad | Turn | None = self._turn(known) or self._dyad(known)
            if group is None:
                raise self._unclosed([self.names[i] for i in range(len(self.bars)) if i not in known])
            known |= {group.bar} if isinstance(group, Turn) else {group.first, group.second}
            found.append(group)
        if self.freedoms < 1:
            raise self._unclosed([])
        return tuple(found)

    def _unclosed(self, left: Sequence[str]) -> InvalidLinkage:
        if self.freedoms < 1:
            return InvalidLinkage(f"it has {self.freedoms} freedoms: a joint, slide or gear is one too many")
        if self.freedoms > 1:
            return InvalidLinkage(
                f"it has {self.freedoms} freedoms; one drive moves a chain of one freedom: connect "
                f"{', '.join(map(quoted, left))} with more bars"
            )
        return InvalidLinkage(
            f"{', '.join(map(quoted, left))} close in no dyad: take another drive, or the chain is of a higher class"
        )

    @cached_property
    def dyads(self) -> tuple[Dyad, ...]:
        """Dyads among the groups."""
        return tuple(group for group in self.groups if isinstance(group, Dyad))

    def _links(self, bar: int, known: set[int]) -> list[Link]:
        """Return the connections of a bar with known ones."""
        pins = [Link(False, j, min(bars & known)) for j, bars in enumerate(self.on) if bar in bars and bars & known]
        slides = [
            Link(True, k, other)
            for k, slide in enumerate(self.slides)
            for one, other in (self._ends(slide), self._ends(slide)[::-1])
            if one == bar and other in known
        ]
        return pins + slides

    def _ends(self, slide: Slide) -> tuple[int, int]:
        return self.number(slide.first), self.number(slide.second)

    def _turn(self, known: set[int]) -> Turn | None:
        for bar in range(len(self.bars)):
            links = [] if bar in known else [link for link in self._links(bar, known) if not link.is_slide]
            for gear in self.gears if len(links) == 1 else ():
                for wheel, ratio in ((gear.first, gear.ratio), (gear.second, 1 / gear.ratio if gear.ratio else 0.0)):
                    other = gear.second if wheel == gear.first else gear.first
                    # in ratio 1 the carrier does not matter
                    here = Gear(wheel, other, wheel if ratio == 1 else gear.carrier, ratio)
                    ends = self.number(here.first), self.number(here.carrier)
                    if self.number(other) == bar and {*ends} <= known:
                        return Turn(bar, links[0], here, *ends)
        return None

    def _dyad(self, known: set[int]) -> Dyad | None:
        for one, two in combinations([i for i in range(len(self.bars)) if i not in known], 2):
            pins = [j for j, bars in enumerate(self.on) if {one, two} <= bars and not bars & known]
            slides = [k for k, slide in enumerate(self.slides) if {*self._ends(slide)} == {one, two}]
            links = self._links(one, known), self._links(two, known)
            if len(pins) + len(slides) != 1 or len(links[0]) != 1 or len(links[1]) != 1:
                continue
            first, second = (one, two) if not links[0][0].is_slide else (two, one)  # order: pin before slide
            a, b = (links[0][0], links[1][0]) if first == one else (links[1][0], links[0][0])
            outer, inner = a.is_slide + b.is_slide, bool(slides)
            kind = {(0, 0): RRR, (1, 0): RRP, (0, 1): RPR, (2, 0): PRP, (1, 1): RPP}.get((outer, int(inner)))
            if kind is not None:
                return Dyad(kind, first, second, (a, b), (slides or pins)[0])
        return None

    @cached_property
    def rates(self) -> tuple[Fraction | None, ...]:
        """Rotation of each bar per rotation of the drive; None where the ratio is not constant."""
        bar, link = self.driver
        rate: list[Fraction | None] = [None] * len(self.bars)
        rate[self.frame], rate[bar] = Fraction(0), Fraction(0 if link.is_slide else 1)
        for group in self.groups:
            if isinstance(group, Turn):
                a, c = rate[group.wheel], rate[group.carrier]
                ratio = Fraction(group.gear.ratio).limit_denominator(Most.TEETH)
                rate[group.bar] = None if a is None or c is None else c + ratio * (a - c)
                if rate[group.bar] is None and ratio.denominator != 1:
                    raise InvalidLinkage(
                        f"the wheel {quoted(self.names[group.bar])} needs a whole ratio, as its pair does not turn in "
                        "proportion to the drive"
                    )
                exact = abs(float(ratio) - group.gear.ratio) <= 1e-12 * abs(group.gear.ratio)
                if not exact or abs(ratio.numerator) > Most.TEETH:
                    raise InvalidLinkage(
                        f"the gear ratio {group.gear.ratio:.12g} is no fraction of teeth up to {Most.TEETH}"
                    )
            elif group.kind in (RRP, PRP, RPP):
                rate[group.second] = rate[group.outer[1].to]
                if group.kind != RRP:
                    rate[group.first] = rate[group.outer[0].to if group.kind == PRP else group.outer[1].to]
        return tuple(rate)

    @cached_property
    def turns(self) -> int:
        """Number of turns of the drive after which all wheels have returned to their start."""
        count = lcm(*(rate.denominator for rate in self.rates if rate is not None))
        if count > Most.TURNS:
            raise InvalidLinkage(
                f"its wheels are back only after {quoted(count)} turns of the drive, at most {int(Most.TURNS)} are "
                "followed: take gear ratios with common factors"
            )
        return count
