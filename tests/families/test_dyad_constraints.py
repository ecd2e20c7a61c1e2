"""Every constraint on every family of two dyads is kept, or refused by its name.

Only given starts are tried, stretches of random linkages, so that every family has answers.
Figures are measured by formulas that share nothing with those of the catalogue.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, Constraints, InvalidRequest, StraightLine
from catalogue.find.names import contradiction
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR
from catalogue.quantities import BOUNDS
from catalogue.search import starts
from tests.families.conftest import STROKE

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
from independent_figures import BOUNDS as FIGURES
from independent_figures import Figures, measured, violations

families = pytest.mark.parametrize("family", FAMILIES)
TOLERANCE = 0.02
LINE = StraightLine(STROKE, TOLERANCE, unit="mm")
#: Largest error of figures at 401 stations: speeds from differences.
CLOSE = {"min_uniformity": 2e-2, "min_advantage": 2e-2}
#: Constraints that do not go with starts, and their values.
REFUSED: dict[str, Any] = {
    "slots": True,
    "returns": True,
    "fixed_pivots": (0, 1, 1, 1),
    "moving_pivots": (0, 1, 1, 1),
    "crank": (0, 1, 1, 1),
}
REGIONS = ("fixed_pivots_in", "pivots_in", "swept_in", "keep_out")
#: Sorts that hold for the ancestors of answers: the given linkages have none.
SORTS: dict[str, Any] = {"series": ["IV.l"], "configurations": ["PP"], "order": 3}
#: Constraints with tests of their own, or that go with another one.
OTHERS = {"families", "pins_only", "full_rotation", "within", "play"}
#: Bounds whose values are compared: an allowance takes a simulation, a lift and a turn a whole circuit.
COMPARED = [name for name in FIGURES if name not in ("min_allowance", "min_transmission_turn")]


def test_every_constraint_is_tried() -> None:
    tried = {*COMPARED, "min_allowance", "min_transmission_turn", "min_lift", *REGIONS, *SORTS, *REFUSED, *OTHERS}
    assert tried == {one.name for one in fields(Constraints)}


@pytest.fixture(scope="module")
def ask(small: Catalogue, stretches: Callable[[str], list[Any]]) -> Iterator[Callable[..., Any]]:
    """Return a finder of answers among the stretches of a family as they are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(starts.Starts, "_stored", lambda *_: None)
        patch.setattr(starts.Starts, "_made_at_once", lambda *_: [])
        patch.setattr(starts, "DRAWN_LINKAGES", 20)
        how: dict[str, Any] = {"limit": 8, "distinct": 0, "per_series": 0, "refine": False}

        def found(family: str, **wanted: Any) -> list[Any]:
            answers = small.find(LINE, starts=stretches(family), **how, **wanted)
            return [one for one in answers if one.family == family]

        yield found


@pytest.fixture(scope="module")
def free(ask: Callable[..., Any]) -> Callable[[str], list[tuple[Any, Figures]]]:
    """Return the answers of a family without constraints, with their figures."""

    @cache
    def found(family: str) -> list[tuple[Any, Figures]]:
        return [(one, figures(one)) for one in ask(family)]

    return found


def figures(one: Any, *, turns: bool = False) -> Figures:
    found = measured(one.pivots, one.guided, STROKE, circle=False, turns=turns, stations=401)
    assert found is not None
    return found


def key(one: Any) -> tuple[float, ...]:
    """Return the lengths of a linkage, which tell it from others wherever it is mirrored."""
    return tuple(round(abs(value), 6) for value in one.lengths.values())


@pytest.mark.slow
@families
def test_bounds_are_kept_and_none_is_ignored(ask: Any, free: Any, family: str) -> None:
    """Of answers without it, a bound at the median leaves those that meet it."""
    for name in COMPARED:
        row, known = BOUNDS[name], [(one, getattr(m, FIGURES[name])) for one, m in free(family)]
        values = [value for _, value in known if value is not None and np.isfinite(value) and value > 0]
        bound = float(np.median(values)) if values else 1.0
        found = ask(family, **{name: bound})
        if not values:  # nothing slides, no link joins pivots, or no crank drives
            assert len(found) == (0 if row.needs_crank else len(known)), name
            continue
        close = CLOSE.get(name, 2e-3)
        for one in found:
            assert violations(figures(one), {name: bound}, 2 * TOLERANCE, STROKE).get(name, 0) <= close, name
        side = 1 if row.is_upper else -1
        met = [key(one) for one, value in known if value is None or side * (value - bound) < -close * bound]
        assert {*met} <= {key(one) for one in found}, name


@pytest.mark.slow
@families
@pytest.mark.parametrize("name", ["full_rotation", "min_transmission_turn", "min_lift"])
def test_bounds_over_the_turn_are_kept(ask: Any, family: str, name: str) -> None:
    """A crank turns fully, and its least transmission angle is as large as asked for."""
    value = {"full_rotation": True, "min_transmission_turn": 5.0, "min_lift": 0.1 * STROKE}[name]
    found = ask(family, **{name: value})
    if RR not in FAMILIES[family]:
        assert not found
    for one in found:
        broken = violations(figures(one, turns=True), {name: value, "full_rotation": True}, 2 * TOLERANCE, STROKE)
        assert broken["full_rotation"] <= 1e-9
        assert broken.get(name, 0) <= 1e-6
        assert name != "min_lift" or one.lift >= value * (1 - 1e-3)


@pytest.mark.slow
@families
def test_regions_are_kept(ask: Any, free: Any, family: str) -> None:
    """A box about an answer has that answer or another one in it; a zone beside it leaves it."""
    one, m = free(family)[0]
    for name in REGIONS:
        places = {"fixed_pivots_in": m.fixed, "pivots_in": np.concatenate([m.fixed, m.moving])}.get(name, m.segments)
        x0, y0, x1, y1 = places.real.min(), places.imag.min(), places.real.max(), places.imag.max()
        box = (x0 - 0.01, y0 - 0.01, x1 + 0.01, y1 + 0.01)
        box = (x0 - 1, y1 + 0.01, x1 + 1, y1 + 1) if name == "keep_out" else box
        found = ask(family, **{name: [box] if name == "keep_out" else box})
        assert key(one) in {key(other) for other in found}, name
        for other in found:
            wanted = {name: [box] if name == "keep_out" else box}
            assert violations(figures(other), wanted, 2 * TOLERANCE, STROKE)[name] <= 2e-3, name


@pytest.mark.slow
@families
def test_play_and_a_least_allowance_are_kept(ask: Any, free: Any, family: str) -> None:
    values = [one.allowance for one, _ in free(family)]
    bound = float(np.median(values))
    found = ask(family, min_allowance=bound)
    assert len(found) >= sum(value > bound for value in values)
    assert all(one.allowance >= bound * (1 - 1e-9) for one in found)
    expected = [(one.deviation, one.expected) for one in ask(family, play=0.1 * min(values))]
    assert any(more is not None for _, more in expected)
    assert all(more is None or least < more <= TOLERANCE for least, more in expected)


@families
def test_sorts_of_stored_guides_leave_out_given_linkages(ask: Any, family: str) -> None:
    for name, value in SORTS.items():
        assert not ask(family, **{name: value})


@families
def test_what_does_not_go_with_starts_is_refused(ask: Any, family: str) -> None:
    for name, value in REFUSED.items():
        with pytest.raises(InvalidRequest, match="given pivots, slots and returning points are found without starts"):
            ask(family, **{name: value})


@families
def test_what_a_family_has_not_is_told(family: str) -> None:
    dyads, told = FAMILIES[family], {}
    for name in (*BOUNDS, "pins_only", "full_rotation", "fixed_pivots", "moving_pivots", "crank"):
        value: Any = REFUSED.get(name, True if name in ("pins_only", "full_rotation") else 1.0)
        if found := contradiction(Constraints(families=[family], **{name: value})):
            told[name] = found[1]
    over_the_turn = ("min_transmission_turn", "min_lift", "full_rotation")
    drive = ("min_drive_angle", "max_drive_angle", "min_uniformity", "min_advantage")
    wanted = {"pins_only"} if dyads != (RR, RR) else set()
    wanted |= {"fixed_pivots"} if PR in dyads else set()
    wanted |= {"moving_pivots"} if RP in dyads else set()
    wanted |= {"crank", *over_the_turn, *drive} if RR not in dyads else set()
    assert {*told} == wanted
    assert contradiction(Constraints(families=[family, "four-bar"], pins_only=True)) is None
