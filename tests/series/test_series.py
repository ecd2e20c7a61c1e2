"""Series, members, parameters and guided elements: data that cannot contradict themselves."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from catalogue.curvature_theory.leading_error import EXACT
from catalogue.errors import PluginError
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.series.pairs import linkage_of, normal_pair, slider_pair
from catalogue.series.sampling import draw
from catalogue.series.series import Guided, Member, Parameter, Series, angles, inverse_family

A = Parameter("a", ((0.0, 1.0),), "a number")
Q = Parameter("q", ((-2.0, -1.5), (0.5, 3.0)), "another")
ends = st.lists(st.floats(-1e3, 1e3).map(lambda x: round(x, 3)), min_size=2, max_size=8, unique=True).map(sorted)
domains = ends.map(lambda e: tuple(zip(e[: len(e) // 2 * 2 : 2], e[1::2], strict=True)))
shares = arrays(float, st.integers(1, 20), elements=st.floats(0, 1, exclude_max=True))


def pivots(p: Any) -> Any:
    return linkage_of(normal_pair(p["q"]), slider_pair(np.sin(p["a"]), np.cos(p["a"])))


def guided(p: Any) -> list[Guided]:
    return [Guided("undulation", normal_pair(0 * p["q"]), 3)]


MEMBER = Member("general", "slider-crank", [A, Q], pivots)
SERIES = Series(
    "V.test", "a test", "V*.test", "nowhere", [MEMBER], lambda i: (np.ones(len(i)), np.ones(len(i))), guided
)


# -- parameters -------------------------------------------------------------------------------------------------------
@pytest.mark.slow
@given(domain=domains, share=shares)
def test_shares_are_spread_within_the_domain_and_in_order(domain: Any, share: Any) -> None:
    p = Parameter("x", domain, "")
    values = p.spread(share)
    assert values.shape == share.shape
    slack = 1e-9 * max(abs(e) for interval in domain for e in interval)
    inside = [(values >= a - slack) & (values <= b + slack) for a, b in domain]
    assert np.any(inside, axis=0).all()
    assert np.all(np.diff(values[np.argsort(share)]) >= -slack)


@pytest.mark.slow
@given(domain=domains)
def test_equal_shares_cover_equal_lengths(domain: Any) -> None:
    p = Parameter("x", domain, "")
    width = np.array([b - a for a, b in domain])
    values = p.spread((np.arange(10_000) + 0.5) / 10_000)
    found = [np.mean((values >= a) & (values <= b)) for a, b in domain]
    np.testing.assert_allclose(found, width / width.sum(), atol=2e-4)


@pytest.mark.slow
@given(domain=domains)
def test_a_domain_holds_its_ends_and_not_its_gaps(domain: Any) -> None:
    p = Parameter("x", domain, "")
    edges = np.array(domain)
    assert p.holds(edges).all()
    assert p.holds(edges.mean(axis=1)).all()
    gaps = 0.5 * (edges[:-1, 1] + edges[1:, 0])
    assert not p.holds(np.concatenate([gaps, [edges[0, 0] - 1, edges[-1, 1] + 1]])).any()


@given(shape=st.sampled_from([(), (3,), (2, 3)]))
def test_shares_may_have_any_shape(shape: tuple[int, ...]) -> None:
    assert Q.spread(np.zeros(shape)).shape == shape
    assert np.all(Q.spread(np.zeros(shape)) == -2.0)


@pytest.mark.parametrize(
    "domain",
    [(), ((1.0, 1.0),), ((1.0, 0.0),), ((0.0, 1.0), (0.5, 2.0)), ((2.0, 3.0), (0.0, 1.0)), ((0.0, np.inf),),
     ((np.nan, 1.0),), ((0.0, 1.0), (1.0, 2.0))],
)  # fmt: skip
def test_a_domain_must_be_increasing_finite_intervals(domain: Any) -> None:
    with pytest.raises(PluginError, match="parameter x: the domain must be increasing finite intervals"):
        Parameter("x", domain, "")


# -- members ----------------------------------------------------------------------------------------------------------
def test_a_member_gives_pivots_for_a_batch_or_for_one() -> None:
    many = MEMBER.synthesise({"q": np.array([0.5, 2.0]), "a": np.array([0.1, 0.2]), "unused": np.zeros(2)})
    one = MEMBER.synthesise({"q": np.array(2.0), "a": np.array(0.2)})
    assert many.shape == (2, 2, 2, 3)
    np.testing.assert_array_equal(one, many[1:])


def test_derived_parameters_are_added_to_the_free_ones() -> None:
    twice = Member("special", "slider-crank", [A], pivots, derive=lambda p: {"q": 2 * p["a"]})
    complete = twice.complete({"a": np.array([0.5])})
    assert {name: value.tolist() for name, value in complete.items()} == {"a": [0.5], "q": [1.0]}
    np.testing.assert_array_equal(
        twice.synthesise({"a": np.array([0.5])}), MEMBER.synthesise({"a": np.array([0.5]), "q": np.array([1.0])})
    )


def test_a_plugin_changes_nothing_of_what_it_is_given() -> None:
    def writes(p: Any) -> Any:
        p["q"][:] = 9
        return pivots(p)

    def replaces(p: Any) -> Any:
        p["q"] = 9 * p["q"]
        return pivots(p)

    free = {"a": np.array([0.5]), "q": np.array([1.0])}
    for bad in (replace(MEMBER, pivots=writes), replace(MEMBER, pivots=replaces), replace(MEMBER, derive=writes)):
        with pytest.raises((ValueError, TypeError), match=r"read-only|item assignment"):
            bad.synthesise(free)
    drawn = draw(SERIES, MEMBER, 0, 0)
    assert isinstance(drawn.complete, MappingProxyType)
    assert not any(values.flags.writeable for values in drawn.complete.values())
    assert free == {"a": 0.5, "q": 1.0}


def test_a_missing_parameter_is_named() -> None:
    with pytest.raises(PluginError, match=r"^slider-crank general: parameter q is missing$"):
        MEMBER.synthesise({"a": np.zeros(1)})


@pytest.mark.parametrize("shape", [(2, 2, 3), (1, 2, 3), (1, 2, 2, 2)])
def test_pivots_of_a_wrong_shape_are_refused(shape: tuple[int, ...]) -> None:
    wrong = replace(MEMBER, pivots=lambda _: np.ones(shape))
    with pytest.raises(PluginError, match=r"slider-crank general: pivots have shape .*, not \(n, 2, 2, 3\)"):
        wrong.synthesise({"a": np.ones(1), "q": np.ones(1)})


def test_only_valid_linkages_are_made() -> None:
    free = {"q": np.array([1.0, 0.0]), "a": np.array([0.5, 0.0])}
    linkage, mask = Linkage.valid(SERIES.member("slider-crank general").synthesise(free))
    assert mask.tolist() == [True, False]  # the second: both pairs are one slider
    assert linkage.family.tolist() == ["slider-crank"]


# -- series -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"code": ""}, "code, title and source must not be empty"),
        ({"title": ""}, "code, title and source must not be empty"),
        ({"source": ""}, "code, title and source must not be empty"),
        ({"members": []}, "series V.test: it has no member"),
        ({"members": [MEMBER, replace(MEMBER, weight=2.0)]}, "two members have the name 'slider-crank general'"),
    ],
)
def test_contradictory_series_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(PluginError, match=message):
        replace(SERIES, **changes)


def test_a_member_is_found_by_its_key() -> None:
    assert SERIES.member("slider-crank general") is MEMBER
    with pytest.raises(PluginError, match=r"series V.test has no member 'x'; it has slider-crank general"):
        SERIES.member("x")


def test_families_are_listed_once_in_order() -> None:
    names = ["oldham", "four-bar", "oldham"]
    members = [replace(MEMBER, name=str(i), family=name) for i, name in enumerate(names)]
    assert replace(SERIES, members=members).families == ["oldham", "four-bar"]


def test_angles_are_given_in_degrees() -> None:
    assert angles((-90, 0), (45, 90)) == ((-np.pi / 2, 0.0), (np.pi / 4, np.pi / 2))


# -- inversion --------------------------------------------------------------------------------------------------------
def test_the_family_of_the_inverse_is_an_involution() -> None:
    assert {name: inverse_family(name) for name in FAMILIES} == {
        "four-bar": "four-bar",
        "slider-crank": "inverted-slider-crank",
        "inverted-slider-crank": "slider-crank",
        "swinging-block": "swinging-block",
        "elliptic-trammel": "oldham",
        "oldham": "elliptic-trammel",
    }


@pytest.mark.slow
@given(
    pairs=arrays(float, (4, 2, 3), elements=st.floats(-1e6, 1e6) | st.just(np.nan)),
    label=st.sampled_from(["[1]", "undulation", "cuspidation", "centre"]),
    order=st.sampled_from([3, 4, 5, EXACT]),
)
def test_inverting_a_guided_element_twice_changes_nothing(pairs: Any, label: str, order: int) -> None:
    element = Guided(label, pairs, order)
    again = element.inverted().inverted()
    assert (again.label, again.order) == (label, order)
    np.testing.assert_array_equal(again.pairs, pairs)


def test_inversion_exchanges_undulation_and_cuspidation_fixed_and_moving() -> None:
    inverse = Guided("undulation", np.array([[[0.0, 1.0, 0.0], [0.0, 1.0, 1.0]]]), 3).inverted()
    assert inverse.label == "cuspidation"
    np.testing.assert_array_equal(inverse.pairs, [[[0.0, -1.0, 1.0], [0.0, -1.0, 0.0]]])


def test_inversion_exchanges_undulation_and_cuspidation_in_the_names_of_members() -> None:
    members = [replace(SERIES.members[0], name=name) for name in ("general", "pseudo-undulation", "double cuspidation")]
    inverse = replace(SERIES, members=members).inversion("V*.test", "inverse")
    assert [m.name for m in inverse.members] == ["general", "pseudo-cuspidation", "double undulation"]


def test_the_inverse_of_a_series_is_in_the_inverse_families_and_names_its_twin() -> None:
    inverse = SERIES.inversion("V*.test", "inverse")
    assert (inverse.code, inverse.inverse, inverse.source) == ("V*.test", "V.test", "inversion of V.test")
    assert inverse.families == ["inverted-slider-crank"]
    assert [g.label for g in inverse.guided({"q": np.ones(1), "a": np.ones(1)})] == ["cuspidation"]
