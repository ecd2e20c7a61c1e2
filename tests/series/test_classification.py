"""Classification: order of the series, tolerance, guided elements, singularities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue.curvature_theory.instant import Instant
from catalogue.curvature_theory.leading_error import leading_error
from catalogue.errors import InvalidRequest
from catalogue.kinematics.linkage import Linkage
from catalogue.plugin.registry import Registry
from catalogue.testing.contact import contact_order, taylor
from catalogue.testing.sample import even

Maker = Callable[..., Linkage]
EVANS = [[[0.0, 0, 1], [1.0, 0, 1]], [[2, 2.5, 1], [2.0, 0, 1]]]
WATT = [[[0.0, 0, 1], [1.0, 0, 1]], [[2, -1.2, 1], [1, -1.2, 1]]]
REGISTRY = Registry()
#: The undulation point of a linkage with a slider is the slider itself, which is not guided but guides.
DRIVING = {"slider-crank": {"undulation"}, "inverted-slider-crank": {"cuspidation"}}


# -- which series, and in which order ---------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize("code", REGISTRY.series)
def test_members_of_a_series_are_named_by_it_first(code: str) -> None:
    """Unless a narrower one holds them too: the containments of the series, by their special members."""
    series = REGISTRY.get(code)
    for member in series.members:
        linkage = even(series, member, size=16).valid.linkage
        for one in catalogue.classify(linkage):
            assert code in one.series, (member.key, one.series)
            if series.degenerate:
                first = one[0].series
                there = REGISTRY.get(first)
                assert one.nearest == one[0]
                assert first == code or there.dimension(one[0].family) <= series.dimension(one[0].family)


@pytest.mark.slow
def test_general_and_parallel_come_last(random_linkages: Maker) -> None:
    for family in ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block"):
        for one in catalogue.classify(random_linkages(family, 20, 4)):
            assert one.series == ["general"]
            assert one.near[-1].series == "general" or one.near[-2].series == "general"
            assert one.nearest is not None
            assert one.nearest.series not in ("general", "parallel")
            assert not one.nearest.holds


def test_a_linkage_of_a_family_that_a_series_has_not_is_none_of_its_members(golden: list[dict[str, Any]]) -> None:
    linkage = Linkage([case["pivots"] for case in golden])
    instant = Instant(linkage)
    for code, series in REGISTRY.series.items():
        others = ~np.isin(linkage.family, series.families)
        residual, _ = series.classify(instant)
        assert others.any(), code
        assert not (residual[others] < 1e-3).any(), code


def test_a_classification_is_printed_in_a_line() -> None:
    assert repr(catalogue.classify(WATT)) == "<Classification of <Linkage: 1 four-bar> in 25 series>"
    assert repr(REGISTRY.get("II.xy")) == "<Series II.xy: one crank along the coupler, one perpendicular to it (Evans)>"


@pytest.mark.slow
def test_tolerance_is_what_counts_as_zero() -> None:
    rounded = [[[0.0, 0, 1], [1, 0.001, 1]], [[2, -1.2, 1], [1.001, -1.201, 1]]]
    assert catalogue.classify(rounded)[0].series == ["general"]
    assert catalogue.classify(rounded, tolerance=1e-2)[0].series == ["IV*.l"]
    for wrong in (-1e-3, 1.0, np.nan):
        with pytest.raises(InvalidRequest, match="the tolerance must be a residual from 0 up to 1"):
            catalogue.classify(WATT, tolerance=wrong)


# -- what they guide --------------------------------------------------------------------------------------------------
def measured(linkage: Linkage, pair: Any) -> int | None:
    """Return the order of contact of a pair with the closed loop, in 100 digits."""
    return contact_order(taylor(linkage.pivots[0], [pair])[0])


@pytest.mark.slow
@pytest.mark.parametrize("family", ["four-bar", "slider-crank", "inverted-slider-crank"])
def test_guided_elements_have_their_orders(family: str, random_linkages: Maker) -> None:
    found = catalogue.classify(random_linkages(family, 6, 9)).guided(radius=1.7)
    assert found.labels[:4] == ["undulation", "cuspidation", "[3]", "[4]"]
    linkage = random_linkages(family, 6, 9)
    seen = set()
    for i in range(6):
        for k, label in enumerate(found.labels):
            assert (found.order[i, k] > 0) == np.isfinite(found.pairs[i, k]).all()
            if found.order[i, k]:
                assert measured(linkage[i], found.pairs[i, k]) == found.order[i, k], (i, label)
                seen.add(label.split()[0])
    assert seen >= {"undulation", "cuspidation", "radius"} - DRIVING.get(family, set())
    frame = found.to_pandas()
    assert len(frame) == (found.order > 0).sum()
    assert list(frame) == ["linkage", "label", *(f"{a}_{b}" for a in ("fixed", "moving") for b in "xyw"), "order"]
    circles = frame[frame["label"].str.startswith("radius")]
    radii = np.hypot(circles["fixed_x"] - circles["moving_x"], circles["fixed_y"] - circles["moving_y"])
    np.testing.assert_allclose(radii, 1.7, rtol=1e-8)


@pytest.mark.slow
def test_special_elements_show_their_order() -> None:
    """Watt's principal pairs coincide in a straight line of order 4; II.xy has no single undulation.  In any frame."""
    draw = np.random.default_rng(6)
    frames = draw.normal(size=(20, 2, 2)) @ [1, 1j]
    for scale, shift in [(1, 0), *frames]:
        found = catalogue.classify(Linkage([WATT, EVANS]).moved(scale, shift))
        elements = found.guided()
        for i in (0, 1):
            pairs = elements.pairs[i, 2:][elements.order[i, 2:] == 4]
            assert len(pairs) == 1 or scale != 1  # rounded, a double root may split
            assert len(pairs) >= 1
            points = (pairs[:, 1, 0] + 1j * pairs[:, 1, 1] - shift) / scale
            assert np.abs(points - (1 - 0.6j, 0)[i]).max() < 1e-6
        assert elements.order[1, 0] == 0
        assert "undulation all over the inflection circle" in found.reason[1]
        assert "coincide" in found.reason[0] or scale != 1


@pytest.mark.slow
def test_singularities_of_paths() -> None:
    linkage = Linkage(EVANS)
    instant = Instant(linkage)
    pole = complex(*instant.curvature.pole[0])
    found = catalogue.classify(EVANS)
    for point, expected in ((pole, (1, 0)), (0j, (0, 2)), (0.3 + 0.4j, (0, 0))):
        p, q = found.singularity(point)
        assert p[0] == expected[0]
        assert q[0] >= expected[1]
        assert leading_error(linkage, np.array([point])).positions[0] == p[0] + q[0] + 2
    with pytest.raises(InvalidRequest, match="finite coordinates"):
        found.singularity(complex(np.nan, 0))


def test_a_series_holds_where_its_residual_vanishes_and_its_margin_does_not() -> None:
    found = catalogue.classify([EVANS] * 200)
    draw = np.random.default_rng(3)
    residual, margin = found.tolerance * 10 ** draw.uniform(-2, 6, (2, *found.residual.shape))
    residual[draw.random(residual.shape) < 0.2] = np.nan
    holds = replace(found, residual=residual, margin=margin).holds
    for row in range(200):
        both = [
            bool(r <= found.tolerance and m > found.tolerance) for r, m in zip(residual[row], margin[row], strict=True)
        ]
        assert holds[row].tolist() == both or (not any(both) and holds[row].sum() == 1)


def test_a_table_names_all_series_that_hold() -> None:
    members = [even(series, series.members[0], size=2).valid.linkage.pivots[:1] for series in REGISTRY.series.values()]
    found = catalogue.classify(np.concatenate(members))
    table = found.to_pandas()
    for one, names, nearest in zip(found, table["series"], table["nearest"], strict=True):
        assert names == ", ".join(one.series)
        assert one.nearest is not None
        assert nearest == one.nearest.series
    assert {name for names in table["series"] for name in names.split(", ")} >= {*REGISTRY.series}


@pytest.mark.slow
@pytest.mark.parametrize("code", ["II.yy", "II*.yy", "I.yy"])
def test_pivots_rounded_beside_a_dead_point_are_nearest_to_its_series(code: str) -> None:
    """A dead point of mode II is a dead point too, which I.yy must not say first."""
    registered = Registry().series
    member = registered[code].members[0]
    draw = np.random.default_rng(8)
    free = {p.name: p.spread(draw.random(100)) for p in member.parameters}
    linkage, _ = Linkage.valid(member.synthesise(free))
    for part, least in ((1e-7, 0.95), (1e-5, 0.93), (1e-3, 0.8)):
        off = part * linkage.size[:, None, None, None] * draw.normal(size=(*linkage.pivots.shape[:3], 2))
        pivots = linkage.pivots.copy()
        pivots[..., :2] += off * linkage.finite[..., None]
        found = [one.nearest.series if one.nearest else "" for one in catalogue.classify(Linkage(pivots))]
        assert np.mean(np.array(found) == code) >= least, (part, found)
