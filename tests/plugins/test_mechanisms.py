"""Families of mechanisms of many bars: the contract, and what each is known for."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue
from catalogue.collections.goal import Bound, Goal
from catalogue.collections.spec import Collection, Specimen
from catalogue.find.specimens import find_in
from catalogue.kinematics.types import Floats
from catalogue.plugin.refine_mechanisms import ChainModel, Chains, MeasuredChains, on_one_leg
from catalogue.plugin.registry import Registry
from catalogue.problem.path import CircularArc, PathRequest, StraightLine
from catalogue.testing import CollectionContract

REGISTRY = Registry()


class TestSixBars(CollectionContract):
    collection = REGISTRY.collection("six-bars")


class TestExactCells(CollectionContract):
    collection = REGISTRY.collection("exact-cells")


class TestTranslatingPlatforms(CollectionContract):
    collection = REGISTRY.collection("translating-platforms")


class TestGearedFiveBars(CollectionContract):
    collection = REGISTRY.collection("geared-five-bars")


class TestLevelTables(CollectionContract):
    """The family of the author's guide, dropped in."""

    collection = Registry([str(Path(__file__).parents[1] / "collections" / "dropin")]).collection("level-tables")


@pytest.mark.slow
def test_tables_kept_level_do_not_turn() -> None:
    some = drawn(TestLevelTables.collection, "level-table")
    assert len(some) > 10
    assert max(one.metrics["rotation"] for one in some) == 0


def drawn(collection: Collection, family: str, count: int = 30) -> list[Specimen]:
    return list(collection.draw(family, np.random.default_rng(2), count))


@pytest.mark.slow
@pytest.mark.parametrize("family", TestExactCells.collection.families)
def test_exact_cells_draw_straight_lines_to_rounding(family: str) -> None:
    some = drawn(TestExactCells.collection, family)
    assert len(some) > 10
    assert {one.kind for one in some} == {"line"}
    assert max(one.deviation for one in some) < 1e-13


@pytest.mark.slow
def test_cartwrights_joint_runs_on_the_line_of_symmetry() -> None:
    """Its cranks turn fully if a rod reaches from the line to a crank pin farthest from it."""
    some = drawn(TestGearedFiveBars.collection, "cartwright")
    assert {one.kind for one in some} == {"line"}
    assert max(one.deviation for one in some) < 1e-13
    assert {one.configuration for one in some} == {"turns", "swings"}
    for one in some:
        values = one.parameters["values"]
        assert (one.configuration == "turns") == (values["rod"] > 0.5 + values["crank"])
        special = TestGearedFiveBars.collection.classify(one.parameters).special
        assert ("turning" in special) == (one.configuration == "turns")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "ratio"),
    [("geared-five-bar", -1), ("geared-five-bar-half", -0.5), ("geared-five-bar-double", -2), ("belted-five-bar", 2)],
)
def test_geared_cranks_turn_in_their_ratio_and_carry_a_rigid_triangle(family: str, ratio: float) -> None:
    """Distances of joints and angles of the vectors of the cranks, from positions alone."""
    from catalogue import mechanism

    some = drawn(TestGearedFiveBars.collection, family)
    assert len(some) > 10
    one = some[0].parameters
    bars = {"frame": "AE", "crank": "AB", "other": "ED", "coupler": "BCP", "rod": "DC"}
    gears = [{"wheels": ["crank", "other"], "carrier": "frame", "ratio": ratio}]
    own: Any = mechanism({"joints": one["joints"], "bars": bars, "gears": gears, "drive": "crank", "point": "P"})
    z = own.motion(201).points
    a, e = (complex(*one["joints"][name]) for name in "AE")
    first, second = (np.unwrap(np.angle(pin - pivot)) for pin, pivot in ((z["B"], a), (z["D"], e)))
    np.testing.assert_allclose(second - second[0], ratio * (first - first[0]), atol=1e-9)
    assert np.ptp(first) > 0.5
    for one_end, other_end in (("B", "C"), ("D", "C"), ("B", "P"), ("C", "P")):
        assert np.ptp(np.abs(z[one_end] - z[other_end])) < 1e-9


@pytest.mark.slow
def test_platforms_of_cognates_do_not_turn() -> None:
    some = drawn(TestTranslatingPlatforms.collection, "cognate-platform")
    assert len(some) > 10
    assert max(one.metrics["rotation"] for one in some) < 1e-9


@pytest.mark.slow
@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize("request_", [StraightLine(150, 0.05), CircularArc(150, 0.05, 400)], ids=["line", "arc"])
def test_platforms_of_planar_guides_are_as_straight_and_small(small: Catalogue, request_: PathRequest) -> None:
    """Of random ones the smallest is over eight strokes long."""
    guides = small.find(request_, families=["four-bar"], limit=8, min_transmission=30)
    pivots = np.array([one.pivots for one in guides])
    point = np.array([complex(*one.guided) for one in guides])
    collection = TestTranslatingPlatforms.collection
    assert collection.starts is not None
    made = collection.starts(pivots, point, request_)
    measured = collection.measure(made, request_)
    assert len(guides) <= len(made) <= 2 * len(guides)
    for one, parameters in zip(measured, made, strict=True):
        joints = {name: complex(*at) for name, at in parameters["joints"].items()}
        k = complex(parameters["values"]["along"], parameters["values"]["across"])
        assert abs(joints["P"] - joints["Q"]) == pytest.approx(abs(k * (joints["A"] - joints["D"])))
        assert one.metrics["rotation"] < 1e-9
    for guide in guides:  # the platform moves as the guided point does, maybe over a better stretch
        lengths = abs(np.diff([[complex(*at[:2]) for at in crank] for crank in guide.pivots])[:, 0])
        ground = abs(complex(*guide.pivots[0][0][:2]) - complex(*guide.pivots[1][0][:2]))
        its = [
            one.deviation
            for one, parameters in zip(measured, made, strict=True)
            for crank, rocker in (lengths / ground, lengths[::-1] / ground)
            if parameters["values"]["crank"] == pytest.approx(crank)
            and parameters["values"]["rocker"] == pytest.approx(rocker)
        ]
        assert 1 <= len(its) <= 2
        assert max(its) <= 1.001 * guide.deviation + 1e-9
    found = find_in(
        small.database, collection, request_, limit=12, rank_by="size", families=(), series=(),
        where={"min_transmission": (30, None)}, special=(), refine=False, drawn=lambda: None, find=small.find,
    )  # fmt: skip
    assert found[0].metrics["size"] < 2.2 * 150
    assert found[0].metrics["min_transmission"] >= 30
    assert [one.metrics["size"] for one in found] == sorted(one.metrics["size"] for one in found)


@pytest.mark.slow
@pytest.mark.usefixtures("brief")
def test_what_planar_guides_cannot_answer_is_advised(small: Catalogue) -> None:
    """Followed, the advice has an answer; of no four-bars nothing is made, and tags are kept."""

    def asked(line: StraightLine, **how: Any) -> Any:
        options: dict[str, Any] = {"families": (), "series": (), "where": None, **how}
        return find_in(
            small.database, TestTranslatingPlatforms.collection, line, limit=12, rank_by="size", special=(),
            refine=False, drawn=lambda: None, find=small.find, **options,
        )  # fmt: skip

    line = StraightLine(150, 0.05)
    for size in (200, 100):  # no four-bar is as small as the latter
        none = asked(line, where={"size": (None, float(size))})
        assert not none
        told = re.search(rf"relax size <= {size}, .*; the nearest has ([\d.]+)$", none.explain(), re.MULTILINE)
        assert told is not None
        assert float(told[1]) < 2.2 * 150
        assert asked(line, where={"size": (None, float(told[1]))})
    assert not asked(StraightLine(150, 1e-9), where={"min_transmission": (80, None)})
    assert {one.series for one in asked(line, series=["approximate"])} == {"approximate"}


@pytest.mark.slow
def test_six_bars_are_laid_along_the_path() -> None:
    """The guided joint runs from the origin to the stroke on +x, by the joints and the window alone."""
    from catalogue import mechanism

    collection = TestSixBars.collection
    some = [one for one in drawn(collection, "watt-1") if one.kind == "line"][:5]
    for laid in collection.measure([one.parameters for one in some], StraightLine(200, 5)):
        p = laid.parameters
        bars = {"frame": "AD", "crank": "AB", "coupler": "BCE", "rocker": "CDG", "rod": "EFP", "link": "FG"}
        own = mechanism({"joints": p["joints"], "bars": bars, "drive": "crank", "point": "P"})
        low, high = p["window"]
        s = np.linspace(low, high, 401)
        z = own.circuit.pose(s[:, None]).point(np.array([own.guided_point]))[:, 0]
        assert np.ptp(z.real) == pytest.approx(200, rel=1e-6)
        assert min(z.real) == pytest.approx(0, abs=1e-4)
        assert np.abs(z.imag).max() == pytest.approx(laid.deviation, rel=1e-3)
        assert np.ptp(np.unwrap(np.angle(own.circuit.poses(s[:, None]).turn[own.circuit.bar, :, 0]))) == pytest.approx(
            np.radians(laid.metrics["rotation"]), abs=1e-3
        )


@pytest.mark.slow
def test_every_six_bar_has_six_bars_and_seven_pins() -> None:
    for family, wanted in TestSixBars.collection.families.items():
        some = drawn(TestSixBars.collection, family, 10)
        assert wanted == ("approximate",)
        assert {one.metrics["bars"] for one in some} == {6.0}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "family"), [("six-bars", "stephenson-3"), ("translating-platforms", "cognate-platform")]
)
@pytest.mark.parametrize("request_", [StraightLine(1, 0.1), CircularArc(1, 0.1)], ids=["line", "arc"])
def test_refined_mechanisms_are_straighter_and_of_their_family(name: str, family: str, request_: PathRequest) -> None:
    collection = REGISTRY.collection(name)
    assert collection.refine is not None
    some = [one.parameters for one in drawn(collection, family, 40) if one.kind == request_.kind]
    found = collection.refine(some, request_, Goal(bounds=[Bound("size", 0.0, 6.0, 1.0)]))
    assert len(found) == len(some)
    moved = [(old, new) for old, new in zip(some, found, strict=True) if new is not None]
    better = [new for _, new in moved]
    before, after = collection.measure([old for old, _ in moved], request_), collection.measure(better, request_)
    ratio = np.array([b.deviation / a.deviation for a, b in zip(before, after, strict=True)])
    assert len(ratio) >= 3
    assert np.median(ratio) < 0.1
    assert max(m.metrics["size"] for m in after) <= 6.0
    assert min(m.metrics["min_transmission"] for m in after) >= 5.0
    for one in better:
        assert all(-2 <= value <= 2 * np.pi for value in one["values"].values())
    if name == "translating-platforms":
        assert max(m.metrics["rotation"] for m in after) < 1e-9


def of_differences(
    model: ChainModel, guides: MeasuredChains, read: Callable[[MeasuredChains], Floats], p: int
) -> Floats:
    """Return the derivatives of values (n, k) by the first p coordinates, by differences."""
    ends = []
    for side in (1, -1):
        columns = []
        for k in range(p):
            step = np.zeros((len(guides), p + 2))
            step[:, k] = side * 1e-6
            moved, kept = model.moved(guides, step)
            assert len(kept) == len(guides)
            columns.append(read(moved))
        ends.append(np.stack(columns, axis=-1))
    return (ends[0] - ends[1]) / 2e-6


@pytest.mark.slow
@pytest.mark.parametrize("circle", [False, True], ids=["line", "arc"])
def test_the_linear_problem_has_the_derivatives_of_differences(circle: bool) -> None:
    collection = TestSixBars.collection
    kind = "circle" if circle else "line"
    best = sorted(drawn(collection, "stephenson-3", 40), key=lambda one: one.deviation)
    some = [one.parameters for one in best if one.kind == kind]
    made: Any = collection.draw
    family = made.__self__.families["stephenson-3"]
    values = {one.name: np.array([p["values"][one.name] for p in some]) for one in family.parameters}
    legs, of = on_one_leg(family, values, np.array([p["window"] for p in some]).T)
    unlike = (legs.branch != family.chains(values)[0].branch[:, of]).any(0)  # these close unlike the given pose
    few = np.concatenate([np.flatnonzero(~unlike)[:3], np.flatnonzero(unlike)[:3]])
    assert len(few) == 6
    x, legs = np.stack([*values.values()], axis=1)[of[few]], legs[few]
    goal = Goal("max_link", [Bound("size", 0.0, 3.0, 1.0), Bound("min_transmission", 40.0, np.inf, 1.0)])
    model = ChainModel(family, goal, None if circle else 0.0, 0.01)
    free = np.full(x.shape, np.inf)
    guides = model.measured(Chains(x, -free, free, legs.drive.T, legs.branch.T))
    p = x.shape[1] + 2
    linear = model.linearised(guides)
    step = np.zeros((len(guides), linear.jacobian.shape[2]))
    step[:, :p] = 1e-4 * np.random.default_rng(2).uniform(-1, 1, (len(guides), p))
    moved, _ = model.moved(guides, step)
    for name, unit, pieces in (
        ("size", 1.0, linear.limits["size 1"]),
        ("min_transmission", -1 / 90, linear.limits["min_transmission -1"]),
        ("max_link", 1.0, linear.measures["max_link"]),
    ):
        said = (pieces.value + (pieces.slope @ step[..., None])[..., 0]).max(1) - pieces.value.max(1)
        was = unit * (moved.measures[name] - guides.measures[name])
        assert np.abs(was).max() > 1e-5
        np.testing.assert_allclose(said, was, rtol=0.02, atol=3e-6)
    _, slope = model.errors(guides)
    off = of_differences(model, guides, lambda g: model.errors(g)[0], p)
    for i in range(len(slope)):
        # what the best nominal moves is within its own columns
        left, nominal = off[i] - slope[i, :, :p], slope[i, :, p:]
        rest = left - nominal @ np.linalg.lstsq(nominal, left, rcond=None)[0]
        assert np.abs(rest).max() < 3 * guides.off[i] + 1e-4
