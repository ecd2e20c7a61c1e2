"""Measures as pieces, and their derivatives, against linkages that are moved and measured anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.batch import CandidateBatch, near_path
from catalogue.candidates.feasibility import drive_violations, feasibility, nearer_arm, swept_violations, values
from catalogue.guidance.fixed_nominal import Nominal
from catalogue.guidance.metrics import min_transmission_turn, rotates, rotation_margin
from catalogue.guidance.minimum_zone import grid
from catalogue.guidance.sensitivity import COUNT, displaced, pose_jacobian
from catalogue.guidance.slides import slide_ends, slide_runs
from catalogue.kinematics.linkage import RR, Linkage
from catalogue.kinematics.types import Array
from catalogue.problem.problem import Problem
from catalogue.problem.region import Region
from catalogue.quantities import DRIVE, TRANSMISSIONS
from catalogue.refine.driving import Driving
from catalogue.refine.quantities import NONE, Pieces, Quantities, coordinate_slope, outside
from catalogue.refine.subproblem import PivotCoordinates, linearise
from tests.refine.starts import problem_of, started

STEP = 1e-6
LINE, ARC = StraightLine(1, 5e-3), CircularArc(1, 5e-3, 1)
POLYGON = [(-0.4, -0.3), (1.5, -0.3), (1.5, 0.3), (0.5, 0.2), (-0.4, 0.9)]
CONVEX = [(-0.8, -1.6), (1.9, -1.6), (1.7, 1.2), (-0.8, 1.8)]
NAMES = (
    "size", "max_link", "min_link", "max_ground", "min_ground", "max_arm", "travel", "least_arm", "transmission",
    "full_rotation",
)  # fmt: skip
CRANKS = ("four-bar", "slider-crank", "inverted-slider-crank")
INVERTED = {"families": ["inverted-slider-crank"]}  # of all families the one that is compared fastest
WISHES: list[tuple[Any, dict[str, Any], tuple[str, ...]]] = [
    *((LINE, {"families": [family]}, NAMES) for family in ("four-bar", "slider-crank")),
    (LINE, INVERTED, NAMES),
    (LINE, {"families": ["elliptic-trammel"]}, NAMES[:-1]),
    (ARC, {"families": ["four-bar"]}, NAMES),
    (LINE, {"families": ["four-bar"]}, ("uniformity",)),
    (LINE, {"fixed_pivots_in": (-0.5, -0.5, 1.6, 0.5), "pivots_in": POLYGON}, ("fixed_pivots_in", "pivots_in")),
    *((LINE, {"families": [f], "swept_in": CONVEX}, ("swept_in",)) for f in CRANKS),
]


#: Bounds on how guides are driven, which hardly any guide meets.
DRIVEN: Any = {"min_drive_angle": 300, "max_drive_angle": 1, "max_rotation": 1, "min_uniformity": 0.999,
               "min_advantage": 9}  # fmt: skip


#: Bounds that pieces have in right angles, violations in radians.
RIGHT_ANGLES = {row.name for row in TRANSMISSIONS}


def _pieces(read: Quantities, name: str) -> Pieces:
    return Driving(read)(name) if name in DRIVE else read(name)


class Stations:
    """Pieces of guides and of those that come of a step, at the same places along the nominal."""

    def __init__(self, problem: Problem, found: CandidateBatch) -> None:
        self.problem, self.found = problem, found
        self.nominal = Nominal(1.0, problem.path.radius)  # type: ignore[arg-type]  # none is free here
        low, high = found.traced.low.astype(float), found.traced.high.astype(float)
        self.t = 0.5 * (high + low) + 0.5 * (high - low) * grid(8).nodes[:, None]
        self.place, self.along = self._run(found, self.t)
        self._moved: dict[tuple[int, int], Quantities] = {}

    def pieces(self, name: str, least: Array | None = None) -> Pieces:
        guides = self.found.curve
        by = pose_jacobian(guides.motion, guides.point, self.t, self.along)
        return _pieces(Quantities.of(self.problem, self.found, guides.motion.pose(self.t), by, least), name)

    def moved(self, name: str, k: int, sign: int) -> Array:
        """Return the values after a step of coordinate k of all guides, forward or back."""
        if (k, sign) not in self._moved:
            self._moved[k, sign] = self._after(sign * STEP * np.eye(COUNT)[k])
        return _pieces(self._moved[k, sign], name).value

    def _after(self, step: Array) -> Quantities:
        found = self.found
        linkage, point, good = displaced(found.linkage, found.point, np.tile(step, (len(found), 1)))
        assert good.all()
        now = replace(found, linkage=linkage, point=point)
        t = self.t.copy()
        for _ in range(8):  # Newton by differences
            off, slope = self._run(now, t)[0] - self.place, self._run(now, t + 1e-6)[0] - self._run(now, t - 1e-6)[0]
            t = t - off / slope * 2e-6
        assert np.abs(off).max() < 1e-11
        guides = now.curve
        none = pose_jacobian(guides.motion, guides.point, t, self.along)
        return Quantities.of(self.problem, slid(now, t), guides.motion.pose(t), none)

    def _run(self, found: CandidateBatch, t: Array) -> tuple[Array, Array]:
        """Return how far along the nominal the guided points are, and its directions there."""
        guides = found.curve
        u, v = guides.path(t)
        return self.nominal.along(guides.point + (u + 1j * v) * guides.tangent)


def slid(found: CandidateBatch, t: Array) -> CandidateBatch:
    """Return candidates with the ends of their rails and slots as these places of the stroke show them."""
    run = slide_runs(found.linkage, found.curve.motion.pose(t))
    return replace(found, measures=replace(found.measures, slides=slide_ends(found.linkage, run)))


@pytest.mark.parametrize(
    ("request_", "wish", "names"),
    [pytest.param(*w, marks=() if INVERTED in w else pytest.mark.slow) for w in WISHES],
    ids=str,
)
def test_slopes_are_central_differences(
    small: Catalogue, request_: Any, wish: dict[str, Any], names: tuple[str, ...]
) -> None:
    problem = problem_of(request_, **wish)
    at = Stations(problem, started(small, problem.with_constraints(swept_in=None), 6))
    at.found = slid(at.found, at.t)
    far = ~np.repeat(at.found.linkage.finite.reshape(-1, 4), 2, axis=1)
    for name in names:
        value, slope = at.pieces(name)
        some = 0
        # two cranks may fail by the same inequality: which of them lends its pieces is a matter of rounding
        row, decisive = np.arange(len(value))[:, None], np.argmax(value, axis=1)[:, None]
        kept = (row, decisive if name == "full_rotation" else np.arange(value.shape[1])[None])
        kink = np.zeros(len(value), bool)  # as of a slider whose line meets the pivot
        if name == "full_rotation":
            kink = np.diff(np.sort(value, axis=1)[:, -2:], axis=1)[:, 0] < 1e-4
        value, slope = value[kept], slope[kept]
        for k in range(COUNT):
            ends = [at.moved(name, k, sign) for sign in (1, -1)]
            ends = [end.max(1)[:, None] if name == "full_rotation" else end for end in ends]
            assert ((ends[0] == NONE) == (value == NONE)).all()
            want = np.where(value == NONE, 0.0, (ends[0] - ends[1]) / (2 * STEP))
            got = slope[..., k]
            # 1e-6 of a difference is its rounding; a direction is of length 1, so that a step along it does nothing
            bound = 2e-5 * (1 + np.abs(want).max())
            free = ~kink & (~far[:, k] if k < 8 else True)
            free = free[:, None] & ((name != "transmission") | (np.abs(value) < 0.98))  # an arc sine has a kink at 90
            if name == "swept_in":  # another station may be as far out
                bent = np.abs(ends[0] + ends[1] - 2 * value) > 1e-3 * STEP
                assert bent.mean() < 0.1
                free &= ~bent
            np.testing.assert_allclose(got[free], want[free], atol=bound, err_msg=f"{name} by coordinate {k}")
            some += int((got != 0).any())
        assert some or (value == NONE).all(), f"{name} depends on nothing"


@pytest.mark.slow
@pytest.mark.parametrize("name", DRIVE)
@pytest.mark.parametrize("wish", [{"families": ["slider-crank"]}, {"slots": True}], ids=str)
def test_the_largest_piece_of_a_bound_on_the_drive_is_how_far_it_is_broken(
    small: Catalogue, wish: dict[str, Any], name: str
) -> None:
    """Its slope is a central difference; speeds are read at 9 places of the stroke.  Of a crank that turns back, and is
    no drive, the measure is not known, and the amount 1."""
    problem = problem_of(LINE, **wish)
    found = started(small, problem, 12)
    problem = problem.with_constraints(**{name: DRIVEN[name]})
    at = Stations(problem, found)
    value, slope = at.pieces(name)
    largest, broken = value.max(1), drive_violations(problem, found)[name]
    there = largest > NONE
    assert there.sum() >= 4
    steady = there & (broken != 1)
    assert np.median(np.abs(largest - broken)[steady]) < (0.05 if name == "min_uniformity" else 2e-3)
    lead = np.diff(np.sort(value, axis=1)[:, -2:], axis=1)[:, 0] > 1e-4 if value.shape[1] > 1 else True
    by = slope[np.arange(len(value)), value.argmax(1)]
    far = ~np.repeat(found.linkage.finite.reshape(-1, 4), 2, axis=1)
    for k in range(COUNT):
        one, other = (at.moved(name, k, sign).max(1) for sign in (1, -1))
        free = there & lead & (~far[:, k] if k < 8 else True)
        want = (one - other) / (2 * STEP)
        np.testing.assert_allclose(
            by[free, k], want[free], rtol=2e-3, atol=1e-3 * (1 + np.max(np.abs(want[free]), initial=0))
        )
    assert by[there].any()


@pytest.mark.slow
@pytest.mark.parametrize("wish", [wish for _, wish, _ in WISHES[:4]], ids=str)
def test_the_largest_piece_is_the_measure(small: Catalogue, wish: dict[str, Any]) -> None:
    problem = problem_of(LINE, **wish)
    found = started(small, problem, 20)
    at = Stations(problem, found)
    here = values(problem, found)
    for name, sign in (("size", 1), ("max_link", 1), ("min_link", -1), ("max_ground", 1), ("max_arm", 1)):
        largest = at.pieces(name).value.max(1)
        there = largest > NONE  # a length that does not exist concerns nobody
        want = sign * np.where(np.isfinite(here[name]), here[name], NONE)
        # the size is that of the path itself, which leaves its nominal by a deviation, not of the ends of the nominal,
        # and of rails as far as they are used at the places that are read
        off = 2 * found.deviation.max() + 1e-6 if name == "size" else 1e-12
        np.testing.assert_allclose(largest[there], want[there], atol=off, rtol=0, err_msg=name)
        assert not np.isfinite(np.where(there, np.nan, here[name])).any()
    np.testing.assert_allclose(-at.pieces("least_arm").value.max(1), nearer_arm(found), rtol=1e-12)
    # read at 9 places of the stroke instead of POSES; less than nothing beyond a dead point, where the measure is 0
    least = np.maximum(-at.pieces("transmission").value.max(1), 0)
    np.testing.assert_allclose(least, here["transmission"], atol=0.02)
    told = found.measures.min_transmission
    np.testing.assert_allclose(-at.pieces("transmission", told).value.max(1), told / 90, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("family", CRANKS)
def test_the_largest_piece_of_a_room_is_how_far_a_linkage_reaches_out_of_it(small: Catalogue, family: str) -> None:
    """Read at 9 places of the stroke: no more than that, and hardly less; lifted to it."""
    problem = problem_of(LINE, families=[family], swept_in=(-0.3, -0.4, 1.2, 0.5))
    found = started(small, problem.with_constraints(swept_in=None), 20)
    pieces = Stations(problem, found).pieces("swept_in")
    here = swept_violations(problem, found)["swept_in"]
    one_side = np.abs(here - pieces.value.max(1)) < 0.05  # else it is a corner that is left, farther than its sides
    assert one_side.sum() > 5
    assert (pieces.value.max(1) <= here + 1e-9).all()
    np.testing.assert_allclose(pieces.raised(here).value.max(1), here, rtol=0, atol=1e-12)


def test_a_region_is_the_same_whichever_way_round_it_is_given() -> None:
    """Of a convex one all sides are said, of a bent one the nearest alone."""
    x, y = np.random.default_rng(0).uniform(-2, 2, (2, 50))
    z = x + 1j * y
    for corners, rows in (([(-1, -1), (1, -1), (1.5, 0.5), (0, 1)], 4), (POLYGON, 1)):
        ways = (outside(Region.of("a", c), z, coordinate_slope(len(z), 0)) for c in (corners, corners[::-1]))
        one, other = (sorted(way, key=lambda row: float(row[0][0])) for way in ways)
        assert len(one) == len(other) == rows
        for (far, by), (too, slope) in zip(one, other, strict=True):
            np.testing.assert_allclose(far, too, rtol=1e-12, atol=1e-14)
            np.testing.assert_allclose(by, slope, rtol=1e-12, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("inside", [(-0.5, -0.5, 1.6, 0.5), POLYGON], ids=["box", "polygon"])
def test_pivots_stand_outside_as_far_as_the_pieces_say(small: Catalogue, inside: Any) -> None:
    problem = problem_of(LINE, pivots_in=inside)
    found = started(small, problem_of(LINE), 20)
    far = np.maximum(Stations(problem, found).pieces("pivots_in").value, 0).max(1)
    amount = feasibility(problem, found).amounts["pivots_in"]
    np.testing.assert_array_equal(far > 1e-12, amount > 1e-12)
    assert (far <= amount + 1e-12).all(), "one side of one pivot is no more than all of them"
    assert (far > 0).any()


@pytest.mark.parametrize("slots", [False, True])
@pytest.mark.parametrize("family", CRANKS)
def test_a_crank_turns_fully_where_the_pieces_hold(
    random_linkages: Callable[..., Linkage], family: str, slots: bool
) -> None:
    linkage = random_linkages(family, 2000, 11)
    problem = problem_of(LINE, full_rotation=True, slots=slots)
    found: Any = _Bare(linkage.inverted() if slots else linkage, np.zeros(2000, complex))
    none: Any = None
    value, _ = Quantities.of(problem, found, none, none)("full_rotation")
    held = value.max(1) <= 0
    np.testing.assert_array_equal(held, rotates(linkage) > 0)
    assert 20 < held.sum() < 1980
    margin = np.fmax(*rotation_margin(linkage).T)
    np.testing.assert_allclose(value.max(1), -margin, atol=1e-12)
    assert (linkage.dyads == RR).any(1).all()


@pytest.mark.parametrize("slots", [False, True])
@pytest.mark.parametrize("family", CRANKS)
def test_the_transmission_of_the_turn_is_the_largest_piece_and_has_its_slope(
    random_linkages: Callable[..., Linkage], family: str, slots: bool
) -> None:
    """With slots of the machine, of which the inversion is traced and moved."""
    linkage = random_linkages(family, 2000, 12)
    problem = problem_of(LINE, full_rotation=True, slots=slots)
    none: Any = None

    def turned(some: Linkage, driver: Array) -> Pieces:
        found: Any = _Bare(some.inverted() if slots else some, np.zeros(len(some), complex), driver)
        return Quantities.of(problem, found, none, none)("min_transmission_turn")

    margin = rotation_margin(linkage)
    driver = np.where(np.nan_to_num(margin[:, 0], nan=-1) > 0, 1, 2)
    want = min_transmission_turn(linkage, driver) / 90
    value, slope = turned(linkage, driver)
    turns = np.isfinite(want)
    assert 20 < turns.sum() < 1980
    np.testing.assert_allclose(-value.max(1)[turns], want[turns], atol=1e-7)
    assert (value[~turns].max(1) == 0).all(), "which does not turn transmits nothing over a turn"
    # smooth where no other piece is as large, and the angle is neither 0 nor 90 degrees
    lead = np.diff(np.sort(value, axis=1)[:, -2:], axis=1)[:, 0] > 1e-4
    some = np.flatnonzero(turns & lead & (want > 0.02) & (np.nan_to_num(margin).max(1) > 1e-3))
    by = slope[some, value[some].argmax(1)]
    assert len(some) > 20
    traced = linkage[some].inverted() if slots else linkage[some]
    finite = np.repeat(traced.finite.reshape(-1, 4), 2, axis=1)
    for k in range(8):
        ends = []
        for sign in (1, -1):
            moved, _, good = displaced(
                traced, np.zeros(len(some), complex), np.tile(sign * STEP * np.eye(COUNT)[k], (len(some), 1))
            )
            assert good.all()
            ends.append(-min_transmission_turn(moved.inverted() if slots else moved, driver[some]) / 90)
        free = finite[:, k]
        np.testing.assert_allclose(by[free, k], ((ends[0] - ends[1]) / (2 * STEP))[free], atol=1e-4, rtol=1e-4)
        assert by[free, k].any() or not free.any()


#: Bounds with full rotation and without, and the factor from the unit of their pieces to that which is measured.
LIMITED: list[dict[str, Any]] = [
    {"min_transmission": 55.0},
    {"min_transmission": 55.0, "full_rotation": True},
    {"min_transmission_turn": 35.0},
    {"min_link": 0.8, "max_link": 1.2, "min_ground": 0.7, "max_ground": 1.1, "max_arm": 0.6},
    {"full_rotation": True, "max_drive_angle": 40.0, "min_drive_angle": 90.0},
]


@pytest.mark.slow
@pytest.mark.parametrize("wanted", LIMITED, ids=str)
def test_a_limit_is_broken_by_as_much_as_is_measured(small: Catalogue, wanted: dict[str, Any]) -> None:
    """A bound on the transmission is one over the stroke, also of a crank that is to turn fully."""
    anything = problem_of(LINE, families=["four-bar"])
    problem = problem_of(LINE, families=["four-bar"], **wanted)
    starts = started(small, anything, 60)
    found = near_path(problem, starts.origin, starts.curve)
    rows = linearise(problem, found, found.curve, PivotCoordinates()).limits
    measured = feasibility(problem, found, signed=True).amounts
    for name in wanted:
        value = rows[name].value.max(1) * (np.pi / 2 if name in RIGHT_ANGLES else 1)
        there = measured[name] < 0.99
        assert there.sum() > 10
        np.testing.assert_allclose(value[there], measured[name][there], atol=1e-7)
    ranked = values(problem, found)["transmission"]
    pieces = linearise(problem, found, found.curve, PivotCoordinates()).measures["transmission"]
    np.testing.assert_allclose(-pieces.value.max(1), ranked, atol=1e-7)


class _Bare:
    """Linkages that guide nothing."""

    def __init__(self, linkage: Linkage, point: Array, driver: Array | None = None) -> None:
        self.linkage, self.point, self.measures = linkage, point, SimpleNamespace(driver=driver, slides=None)

    def __len__(self) -> int:
        return len(self.point)


@pytest.mark.slow
def test_what_does_not_exist_concerns_nobody(small: Catalogue) -> None:
    problem = problem_of(LINE, families=["slider-crank"])
    at = Stations(problem, started(small, problem.with_constraints(swept_in=None), 6))
    value, slope = at.pieces("max_ground")
    assert (value == NONE).all()
    assert not slope.any()


@pytest.mark.slow
def test_links_and_ground_are_kept_from_collapsing(small: Catalogue) -> None:
    problem = problem_of(LINE, families=["four-bar"])
    found = started(small, problem, 6)
    none: Any = None
    pieces = Quantities.of(problem, found, none, none).collapse()
    z = found.linkage.points
    links = [z[:, 0, 1] - z[:, 0, 0], z[:, 1, 1] - z[:, 1, 0], z[:, 1, 1] - z[:, 0, 1], z[:, 1, 0] - z[:, 0, 0]]
    length = np.abs(np.stack(links, axis=1))
    np.testing.assert_allclose(pieces.value, np.minimum(length, 0.05) - length, atol=1e-12)
    assert (pieces.value <= 0).all()
