"""One block: pure, and what it stores of each reach is what the finite motion shows when it is traced again."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from catalogue.candidates.batch import CandidateBatch, Origin, on_path
from catalogue.curvature_theory.instant import Instant
from catalogue.curvature_theory.leading_error import CIRCLE, EXACT, LINE
from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.kinds import SLOTS
from catalogue.guidance.reach import LEVELS
from catalogue.guidance.slides import rails, slots
from catalogue.guidance.trace import Traced, trace
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry
from catalogue.populate.block import BLOCKS, Block, block
from catalogue.populate.elements import ELEMENT, RADII, elements_worth_tracing
from catalogue.populate.plan import MAX_EMPTY_BLOCKS, Source
from catalogue.populate.rows import LARGEST, LEAST_TRANSMISSION, PROBLEMS, at_design
from catalogue.series.sampling import BLOCK, PLAN, draw

SERIES = Registry().series
#: One member of several families, with lines, circles, exact guides and links at infinity among them.
MEMBERS = [
    ("I.GG", "four-bar general"),
    ("II.ooo", "elliptic-trammel general"),
    ("II.xy", "four-bar general"),
    ("II*.xy", "slider-crank general"),
    ("IV*.l", "four-bar equal cranks"),
]


@dataclass(frozen=True)
class Again:
    """A block with its reaches traced again from what is stored of them alone."""

    block: Block
    guides: CouplerCurve
    traced: Traced
    shown: CandidateBatch  # laid along a path as `catalogue show` lays it

    def of_guide(self, name: str) -> Array:
        """Return a column of the guides, per reach."""
        return np.asarray(self.block.guides[name])[self.block.reaches["guide"]]


def guiding(made: Block) -> Linkage:
    """Return the linkage of each guide, of a slot the inverse one."""
    pivots = made.mechanisms["pivots"].reshape(-1, 2, 2, 3)[made.guides["mechanism"]]
    slot = np.isin(made.guides["kind"], ("slot", "arc"))[:, None, None, None]
    return Linkage(np.where(slot, pivots[:, :, ::-1], pivots))


def curved(made: Block) -> Array:
    return np.isin(made.guides["kind"], ("circle", "arc"))


@pytest.fixture(scope="module", params=MEMBERS, ids=" ".join)
def again(request: pytest.FixtureRequest) -> Again:
    code, key = request.param
    made = block(SERIES[code], key, 4, 1, BLOCKS.most, "some", "1")
    reaches, guides = made.reaches, made.guides
    owner = reaches["guide"]
    spans = coupler_curve(guiding(made)[owner], (guides["x"] + 1j * guides["y"])[owner])
    circle = curved(made)[owner]
    kinds = [
        trace(spans, reaches["half"], circle=c, split=True, centre=reaches["centre"], nodes=16) for c in (False, True)
    ]
    traced = kinds[0].replaced(circle, kinds[1][circle])
    laid = [on_path(PROBLEMS[c], Origin.made(spans.linkage, code), spans, kinds[c]) for c in (False, True)]
    return Again(made, spans, traced, laid[0].replaced(circle, laid[1][circle]))


@pytest.mark.slow
def test_same_arguments_give_the_same_columns() -> None:
    one, two = (block(SERIES["II*.xy"], "slider-crank general", 4, 1, BLOCKS.most, "some", "1") for _ in range(2))
    for name in ("batch", "mechanisms", "guides", "reaches"):
        first, second = getattr(one, name), getattr(two, name)
        assert first.keys() == second.keys()
        for key in first:
            np.testing.assert_array_equal(first[key], second[key], err_msg=f"{name} {key}")


@pytest.mark.slow
def test_batch_says_where_its_rows_come_from(again: Again) -> None:
    made = again.block
    assert made.batch["kept"] == len(made.mechanisms["pivots"]) <= made.batch["drawn"] == BLOCK
    assert made.batch["guides"] == made.count == len(made.guides["x"])
    assert (made.batch["seed"], made.batch["number"], made.batch["plan"]) == (4, 1, PLAN)


@pytest.mark.slow
@pytest.mark.parametrize("wanted", [40, BLOCKS.most])
def test_as_many_guides_as_are_wanted_in_their_order(again: Again, wanted: int) -> None:
    batch = again.block.batch
    made = block(SERIES[batch["series"]], batch["member"], 4, 1, wanted, "some", "1")
    assert made.count == made.batch["guides"] == min(wanted, again.block.count)
    assert made.batch["wanted"] == wanted
    for kind in np.unique(made.guides["kind"]):
        places = made.guides["cover"][made.guides["kind"] == kind]
        assert places.tolist() == list(range(len(places)))


def test_every_mechanism_guides_and_every_guide_reaches(again: Again) -> None:
    made = again.block
    assert np.unique(made.guides["mechanism"]).tolist() == list(range(made.batch["kept"]))
    assert np.unique(made.reaches["guide"]).tolist() == list(range(made.count))


def test_mechanisms_are_made_of_their_parameters(again: Again) -> None:
    made, series = again.block, SERIES[again.block.batch["series"]]
    rows = [json.loads(text) for text in made.mechanisms["parameters"]]
    member = series.member(made.batch["member"])
    pivots = member.synthesise({p.name: np.array([row[p.name] for row in rows]) for p in member.parameters})
    linkage = Linkage(pivots)
    # two ways to one number: the whole sample, and those that are kept
    np.testing.assert_allclose(linkage.pivots.reshape(-1, 12), made.mechanisms["pivots"], rtol=1e-14, atol=1e-14)
    at = Instant(linkage).curvature
    finite = np.isfinite(at.rho0)
    np.testing.assert_array_equal(np.isfinite(made.mechanisms["rho0"]), finite)
    np.testing.assert_allclose(made.mechanisms["rho0"][finite], 1, rtol=1e-9)
    for name in ("kappa", "kappa_star", "s"):
        np.testing.assert_allclose(made.mechanisms[name][finite], getattr(at, name)[finite], rtol=1e-9, atol=1e-9)
    assert set(made.mechanisms["family"]) == {member.family}


def test_every_reach_traced_again_holds_its_level(again: Again) -> None:
    stored, shown = again.block.reaches, again.shown
    assert set(stored["level"]) <= set(LEVELS)
    assert (shown.deviation <= 10.0 ** stored["level"] * (1 + 1e-6)).all()
    np.testing.assert_allclose(again.traced.fit.stroke, stored["stroke"], rtol=1e-8)
    # two charts may serve a guide equally well: which one it gets, and so its grid, is then a matter of rounding
    np.testing.assert_allclose(shown.deviation, stored["deviation"], rtol=1e-4, atol=1e-14)
    circle = curved(again.block)[stored["guide"]]
    sweep = np.where(circle, np.abs(shown.traced.fit.curvature), 0)
    np.testing.assert_allclose(sweep, stored["sweep"], rtol=1e-4, atol=1e-12)


def test_looser_levels_reach_as_far(again: Again) -> None:
    stored = again.block.reaches
    order = np.lexsort((stored["level"], stored["guide"]))
    same = np.diff(stored["guide"][order]) == 0
    # a secant step may stop short of what another level's found
    assert (stored["stroke"][order][1:] / stored["stroke"][order][:-1])[same].min() > 0.9


def test_measures_are_those_of_the_motion(again: Again) -> None:
    stored, measures = again.block.reaches, again.shown.measures
    for name in ("size", "max_link", "min_link", "max_ground", "max_arm"):
        np.testing.assert_allclose(stored[name], getattr(measures, name), rtol=1e-6, err_msg=name)
    np.testing.assert_allclose(stored["min_transmission"], measures.min_transmission, atol=1e-5)
    np.testing.assert_array_equal(stored["rotates"], measures.rotates)
    assert stored["size"].max() <= LARGEST
    weak = stored["min_transmission"] < LEAST_TRANSMISSION
    assert (at_design(again.guides.linkage)[weak] < LEAST_TRANSMISSION).all()


def test_boxes_hold_the_pivots_when_the_path_lies_from_0_to_1(again: Again) -> None:
    """Whether the way there or back runs from 0 to 1 is a matter of the chart; an arc bulges to +y either way."""
    fit = again.shown.traced.fit
    back = fit.along.real < 0
    start, along = np.where(back, fit.start + fit.stroke * fit.along, fit.start), np.where(back, -1, 1) * fit.along
    linkage, ends = again.shown.linkage, again.shown.measures.slides
    slides = {
        "fixed": rails(linkage, ends),
        "all": np.concatenate([rails(linkage, ends), slots(linkage, ends)], axis=1),
    }
    up = np.where(curved(again.block)[again.block.reaches["guide"]], 1, -1)
    nowhere = complex(np.nan, np.nan)
    for name, planes in (("fixed", (0,)), ("all", (0, 1))):
        z = np.where(linkage.finite[:, :, planes], linkage.points[:, :, planes], nowhere).reshape(len(linkage), -1)
        z = np.concatenate([z, slides[name].reshape(len(linkage), -1)], axis=1)
        z = (z - start[:, None]) * along.conj()[:, None] / fit.stroke[:, None]
        stored = np.stack([again.block.reaches[f"{name}_{side}"] for side in ("x0", "y0", "x1", "y1")])
        off = []
        for x, y in ((z.real, z.imag), (1 - z.real, up[:, None] * z.imag)):
            expected = [least.reduce(side, 1) for least in (np.fmin, np.fmax) for side in (x, y)]
            np.testing.assert_array_equal(np.isnan(stored), np.isnan(expected))
            off.append(np.nan_to_num(np.abs(stored - expected)).max(0) / again.shown.measures.size)
        # errors are known to 1e-4 of the deviation (`minimum_zone`): by twice that the line may turn about an end
        assert (np.minimum(*off) <= 1e-9 + 2e-4 * again.shown.traced.relative).all()


def test_guided_points_are_neither_pivots_nor_far_away(again: Again) -> None:
    made = again.block
    z = made.guides["x"] + 1j * made.guides["y"]
    linkage = guiding(made)
    moving = np.where(linkage.finite[:, :, 1], linkage.points[:, :, 1], np.inf)
    assert np.abs(moving - z[:, None]).min() >= ELEMENT.nearest_pivot
    assert np.abs(z).max() <= ELEMENT.farthest


def test_guides_have_the_tangent_and_the_nominal_of_their_path(again: Again) -> None:
    made = again.block
    guides = coupler_curve(guiding(made), made.guides["x"] + 1j * made.guides["y"])
    tangent = made.guides["tangent_x"] + 1j * made.guides["tangent_y"]
    np.testing.assert_allclose(tangent, guides.tangent, atol=1e-9)
    # the nominal is what a short path is nearest to: a line, or the circle with its centre left of the tangent
    short = trace(guides, np.full(len(guides), 1e-3), circle=True, split=False)
    ahead = np.sign((short.fit.along * tangent.conj()).real)
    curvature = short.fit.curvature * ahead
    np.testing.assert_allclose(made.guides["curvature"], curvature, atol=2e-2 * (1 + np.abs(curvature)).max())
    circle = curved(made)
    assert (made.guides["curvature"][~circle] == 0).all()
    radius = 1 / np.abs(made.guides["curvature"][circle])
    assert ((radius >= RADII[0]) & (radius <= RADII[1])).all()


def test_inflections_follow_from_the_order(again: Again) -> None:
    guides = again.block.guides
    line = ~curved(again.block) & (guides["contact_order"] != EXACT)
    np.testing.assert_array_equal(guides["inflections"], np.where(line, guides["contact_order"] - 1, 0))


def test_leading_coefficient_gives_the_deviation_of_a_short_stroke(again: Again) -> None:
    """Beside orders 3 and 4, whose laws a double still shows: |c| (L/2)^m times the level of u^m."""
    made, order = again.block, again.block.guides["contact_order"]
    exact = order == EXACT
    assert np.isnan(made.guides["leading"][exact]).all()
    some = np.flatnonzero((order <= 4) & (made.guides["leading"] > 1e-3))
    guides = coupler_curve(guiding(made)[some], (made.guides["x"] + 1j * made.guides["y"])[some])
    circle, half = curved(made)[some], np.full(len(some), 0.02)
    kinds = [trace(guides, half, circle=c, split=False) for c in (False, True)]
    found = np.where(circle, kinds[1].fit.deviation, kinds[0].fit.deviation)
    m = order[some] + 1
    level = np.where(circle, [CIRCLE[k] for k in m], [LINE[k] for k in m])
    ratio = found / (made.guides["leading"][some] * half**m * level)
    assert exact.all() or np.isfinite(ratio).sum() > 0.5 * len(some) > 0
    assert exact.all() or abs(np.nanmedian(ratio) - 1) < 0.03


def test_every_pair_is_a_point_or_a_slot_but_not_both(again: Again) -> None:
    """The fixed point of a slot guides the inverse motion; the same label of one mechanism occurs once."""
    guides = again.block.guides
    keys = list(zip(guides["mechanism"].tolist(), guides["label"].tolist(), strict=True))
    assert len(set(keys)) == len(keys)


def test_member_that_guides_nothing_gives_an_empty_block() -> None:
    series = SERIES["II.xy"]
    nothing = replace(series, guided=lambda p: [replace(g, pairs=g.pairs * np.nan) for g in series.guided(p)])
    made = block(nothing, "four-bar general", 0, 0, BLOCKS.most, "some", "1")
    assert made.count == made.batch["kept"] == made.batch["guides"] == 0
    assert len(made.mechanisms["pivots"]) == len(made.reaches["guide"]) == 0


@pytest.mark.parametrize("code", ["II.xy", "II*.xy", "IV*.l"])
def test_what_can_be_guided_as_a_point_is_not_guided_as_a_slot_too(code: str) -> None:
    for member in SERIES[code].members:
        made = elements_worth_tracing(SERIES[code], draw(SERIES[code], member, 0, 0))
        slot = np.isin(made["kind"], [*SLOTS.values()])
        points, slots = ({*zip(made["mechanism"][k], made["label"][k], strict=True)} for k in (~slot, slot))
        assert points
        assert not points & slots


def test_a_member_that_gives_nothing_block_after_block_is_given_up() -> None:
    series = SERIES["II.xy"]
    source = Source(series, Any, series.members[0], 10**6, {})  # type: ignore[arg-type]  # no record is asked for
    for guides in (0, 3, *[0] * MAX_EMPTY_BLOCKS):
        assert not source.full
        source.count(guides)
    assert source.full
    assert (source.next, source.guides) == (MAX_EMPTY_BLOCKS + 2, 3)
