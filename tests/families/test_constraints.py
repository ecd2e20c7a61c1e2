"""Every constraint on every family: kept, as the joints' positions alone show, or refused by its name.

None is ignored: of the answers without it, a bound at the median leaves out some that break it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, Constraints, InvalidRequest, StraightLine
from catalogue.quantities import BOUNDS, DEGREES
from tests.families.conftest import LINE, REGISTRY, ROWS
from tests.families.moved import Moved

rows = pytest.mark.parametrize(("name", "family"), ROWS, ids=[f"{name}-{family}" for name, family in ROWS])
#: Constraints on what a mechanism of many bars has not, with a value that is meant.
REFUSED: dict[str, Any] = {
    "configurations": ["PX"],
    "order": 4,
    "slots": True,
    "returns": True,
    "fixed_pivots": (0, 0, 10, 10),
    "moving_pivots": (0, 0, 10, 10),
    "crank": (0, 0, 10, 10),
    "min_lift": 3,
    "min_allowance": 0.01,
    "min_transmission_turn": 10,
    "play": 0.1,
}
#: Names that have an argument of their own, or go with another constraint.
OTHERS = {"families", "series", "within"}
REGIONS = ("fixed_pivots_in", "pivots_in", "swept_in", "keep_out")
BOUNDED = [name for name in BOUNDS if name not in REFUSED]
#: Relative difference of a measure from positions 401 to a stroke: speeds from differences.
CLOSE = {"uniformity": 0.05, "advantage": 0.02}
SPACE = "spatial-guidance"
PLANAR = [(name, family) for name, family in ROWS if REGISTRY.collection(name).mechanism is not None]
planar = pytest.mark.parametrize(("name", "family"), PLANAR, ids=[family for _, family in PLANAR])


def test_every_constraint_is_a_row_of_the_matrix() -> None:
    known = {*REFUSED, *OTHERS, *REGIONS, *BOUNDED, "pins_only", "full_rotation"}
    assert known == {one.name for one in fields(Constraints)}


@pytest.fixture(scope="module")
def moved(answers_of: Callable[..., Any]) -> Callable[..., list[Moved]]:
    """Return a mover of the answers of a row, without constraints."""

    @cache
    def made(name: str, family: str) -> list[Moved]:
        return [Moved.of(one) for one in answers_of(name, family)]

    return made


@pytest.fixture(scope="module")
def measures_of() -> Callable[[Any], dict[str, float]]:
    """Return a measurer of answers that are not mirrored, each once."""
    known: dict[tuple[str, int], dict[str, float]] = {}

    def measured(answer: Any) -> dict[str, float]:
        key = answer.collection.name, answer.id
        if key not in known:
            known[key] = Moved.of(answer).measures()
        return known[key]

    return measured


@pytest.mark.slow
@planar
def test_measures_are_those_of_the_joints(name: str, family: str, answers_of: Any, measures_of: Any) -> None:
    for answer in answers_of(name, family):
        for measure, value in measures_of(answer).items():
            told = answer.metrics[measure]
            assert told == pytest.approx(value, rel=CLOSE.get(measure, 2e-3), abs=0.01 if measure in CLOSE else 2e-3), (
                measure
            )


@pytest.mark.slow
@planar
@pytest.mark.parametrize("bound", BOUNDED)
def test_a_bound_is_kept(
    families: Catalogue, name: str, family: str, bound: str, answers_of: Any, measures_of: Any
) -> None:
    row = BOUNDS[bound]
    there = [answer.metrics[row.measure] for answer in answers_of(name, family)]
    value = float(np.median(there))
    if value <= 0:  # nothing slides, or turns
        value = 1.0
    if row.unit == DEGREES and not row.is_upper:
        value = min(value, 89.0)
    how: dict[str, Any] = {"families": [family], "limit": 2, "quiet": True, bound: value}
    found = families.find_in(name, LINE, **how)
    wanted = [one for one in there if (one <= value if row.is_upper else one >= value)]
    assert bool(found) or not wanted
    for answer in found:
        measured = measures_of(answer).get(row.measure, 0.0)
        slack = CLOSE.get(row.measure, 2e-3) * (1 + abs(value))
        assert measured <= value + slack if row.is_upper else measured >= value - slack


@pytest.mark.slow
@planar
@pytest.mark.parametrize("region", REGIONS)
def test_a_region_is_kept_by_a_mirror_image(
    families: Catalogue, name: str, family: str, region: str, moved: Any
) -> None:
    """A box about the mirror image of an answer, of a path elsewhere, has that answer or another one in it."""
    one = moved(name, family)[0]
    every = [*one.joints]
    names = one.own.bars["frame"] if region == "fixed_pivots_in" else every
    over = region in ("swept_in", "keep_out")
    x0, y0, x1, y1 = one.box(names, slice(None) if over else len(one.path) // 2)
    box = (x0 - 1, -y1 - 1, x1 + 1, 1 - y0)  # mirrored in the line of the path
    if region == "keep_out":
        box = (x0 - 30, 3 - y0, x1 + 30, 60 - y0)  # what is above the mirrored mechanism
    placed = StraightLine(100, 2, (40, -30), along=90, unit="mm")
    turned = (40 - box[3], box[0] - 30, 40 - box[1], box[2] - 30)
    wish: dict[str, Any] = {"families": [family], "limit": 2, "quiet": True, region: turned}
    found = families.find_in(name, placed, **wish)
    assert found
    for answer in found:
        here = Moved.of(answer)
        assert here.path[0] == pytest.approx(40 - 30j, abs=1.01 * answer.deviation + 1e-6)
        assert here.path[-1] == pytest.approx(40 + 70j, abs=1.01 * answer.deviation + 1e-6)
        assert answer.to_dict().get("over", False) == answer.over
        if region == "keep_out":
            bars = [j for joints in here.own.bars.values() if len(joints) > 1 for j in joints]
            for joint in bars:
                z = here.joints[joint]
                inside = (z.real > turned[0]) & (z.real < turned[2]) & (z.imag > turned[1]) & (z.imag < turned[3])
                assert not inside.any()
            continue
        names = here.own.bars["frame"] if region == "fixed_pivots_in" else [*here.joints]
        low_x, low_y, high_x, high_y = here.box(names, slice(None) if over else len(here.path) // 2)
        spare = 1e-3 * 100
        assert low_x >= turned[0] - spare
        assert low_y >= turned[1] - spare
        assert high_x <= turned[2] + spare
        assert high_y <= turned[3] + spare


@pytest.mark.slow
@planar
def test_a_drive_turns_fully_where_it_must(families: Catalogue, name: str, family: str) -> None:
    for answer in families.find_in(name, LINE, families=[family], limit=3, quiet=True, full_rotation=True):
        assert Moved.of(answer).own.drive_range is None


@pytest.mark.slow
@planar
def test_pins_only_leaves_out_slides_and_gears(families: Catalogue, name: str, family: str, moved: Any) -> None:
    own = moved(name, family)[0].own
    wish: dict[str, Any] = {"families": [family], "limit": 1, "quiet": True, "pins_only": True}
    if own.slides or own.gears or own.parallel:
        with pytest.raises(InvalidRequest, match=f"none of {family} has pins only"):
            families.find_in(name, LINE, **wish)
    else:
        assert families.find_in(name, LINE, **wish)


@rows
@pytest.mark.parametrize("constraint", REFUSED)
def test_what_a_mechanism_has_not_is_refused_by_name(
    families: Catalogue, name: str, family: str, constraint: str
) -> None:
    wish: dict[str, Any] = {"families": [family], "quiet": True, constraint: REFUSED[constraint]}
    with pytest.raises(InvalidRequest) as told:
        families.find_in(name, LINE, **wish)
    assert constraint in str(told.value)
    assert name in str(told.value)
    assert "\n" not in str(told.value)


@rows
@pytest.mark.parametrize("rank_by", ["score", "allowance", "balance", ("size", "deviation")], ids=str)
def test_criteria_of_two_dyads_are_refused_by_name(families: Catalogue, name: str, family: str, rank_by: Any) -> None:
    with pytest.raises(InvalidRequest) as told:
        families.find_in(name, LINE, families=[family], quiet=True, rank_by=rank_by)
    assert str(rank_by) in str(told.value)
    assert f"{name} has deviation" in str(told.value)


@pytest.mark.parametrize("region", REGIONS)
def test_regions_of_mechanisms_in_space_are_refused(families: Catalogue, region: str) -> None:
    wish: dict[str, Any] = {"quiet": True, region: (0, 0, 10, 10)}
    with pytest.raises(InvalidRequest, match="spatial-guidance has no planar mechanisms of many bars"):
        families.find_in(SPACE, StraightLine(100, 2), **wish)


@pytest.mark.slow
def test_effort_multiplies_what_is_followed(families: Catalogue) -> None:
    nowhere: dict[str, Any] = {"fixed_pivots_in": (0, 0, 1e-3, 1e-3), "quiet": True}
    count = [families.find_in("six-bars", LINE, effort=n, refine=False, **nowhere).explanation.verified for n in (1, 2)]
    assert count[0] == 16
    assert count[1] > count[0]
    assert REGISTRY.collection("six-bars").mechanism is not None
