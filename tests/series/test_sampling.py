"""The sample: a Sobol sequence over each domain, cut into blocks, without what could not be built."""

from __future__ import annotations

from collections.abc import Callable
from zlib import crc32

import numpy as np
import pytest
from scipy.stats.qmc import Sobol

from catalogue.kinematics.linkage import FAMILIES, RR, Linkage
from catalogue.plugin.registry import Registry
from catalogue.series.sampling import BLOCK, PROPORTIONS, draw, in_proportion
from catalogue.series.series import Member, Series

SERIES = Registry().series
#: One member of each number of parameters and of intervals of their domains: all are drawn by one function.
MEMBERS = {
    tuple(len(p.domain) for p in member.parameters): (series, member)
    for series in SERIES.values()
    for member in series.members
}.values()
each_member = pytest.mark.parametrize(("series", "member"), MEMBERS, ids=lambda x: getattr(x, "code", None) or x.key)


@each_member
def test_same_seed_and_number_give_the_same_linkages(series: Series, member: Member) -> None:
    one, two = (draw(series, member, 5, 2) for _ in range(2))
    np.testing.assert_array_equal(one.linkage.pivots, two.linkage.pivots)
    for name in one.free:
        np.testing.assert_array_equal(one.free[name], two.free[name])


@each_member
def test_parameters_lie_in_their_domains_and_give_the_linkages(series: Series, member: Member) -> None:
    drawn = draw(series, member, 0, 1)
    assert list(drawn.free) == [p.name for p in member.parameters]
    for parameter in member.parameters:
        assert parameter.holds(drawn.free[parameter.name]).all()
    if len(drawn.linkage):
        np.testing.assert_array_equal(Linkage(member.synthesise(drawn.free)).pivots, drawn.linkage.pivots)
        for name, values in member.complete(drawn.free).items():
            np.testing.assert_array_equal(values, drawn.complete[name])


def shares(member: Member, free: dict[str, np.ndarray]) -> np.ndarray:
    """Undo `Parameter.spread`."""
    out = []
    for p in member.parameters:
        ends = np.array(p.domain)
        width = np.diff(ends)[:, 0]
        start = np.cumsum(width) - width
        k = np.searchsorted(ends[:, 0], free[p.name], side="right") - 1
        out.append((start[k] + free[p.name] - ends[k, 0]) / width.sum())
    return np.stack(out, axis=-1)


@pytest.mark.slow
@each_member
def test_blocks_are_parts_of_one_sobol_sequence(series: Series, member: Member) -> None:
    if not member.parameters:  # one design
        assert len(draw(series, member, 9, 0).linkage) <= 1
        return
    mixed = np.random.default_rng([9, crc32(f"{series.code} {member.key}".encode())])
    whole = Sobol(len(member.parameters), scramble=True, rng=mixed).random(4 * BLOCK)
    for number in range(4):
        found = shares(member, draw(series, member, 9, number).free)
        part = whole[number * BLOCK : (number + 1) * BLOCK]
        distance = np.abs(found[:, None] - part).max(-1)
        match = distance.argmin(1)
        assert distance[np.arange(len(found)), match].max(initial=0) < 1e-12
        assert (np.diff(match) > 0).all()  # each once, in the order of the sequence


def test_seeds_and_members_draw_differently() -> None:
    first, second = SERIES["I.GG"].members[:2]
    one = draw(SERIES["I.GG"], first, 0, 0).free["kappa"]
    assert not np.isin(one, draw(SERIES["I.GG"], first, 1, 0).free["kappa"]).any()
    assert not np.isin(one, draw(SERIES["I.GG"], second, 0, 0).free["kappa"]).any()


def could_be_built(linkage: Linkage) -> bool:
    """The same rule for one linkage, in plain Python."""
    (a, am), (b, bm) = [[(x, y) if w else None for x, y, w in dyad] for dyad in linkage.pivots[0].tolist()]
    lengths = [np.hypot(p[0] - q[0], p[1] - q[1]) for p, q in ((a, am), (b, bm), (am, bm), (a, b)) if p and q]
    far = max(np.hypot(*p) for p in (a, am, b, bm) if p)
    if far > PROPORTIONS.farthest:
        return False
    return not lengths or (min(lengths) >= PROPORTIONS.shortest and max(lengths) <= PROPORTIONS.spread * min(lengths))


@pytest.mark.parametrize("family", [name for name, kinds in FAMILIES.items() if kinds])
def test_proportions_of_many_are_those_of_each(random_linkages: Callable[..., Linkage], family: str) -> None:
    linkage = random_linkages(family, 400, seed=1)
    scale = np.geomspace(0.03, 12, len(linkage))  # from too small to too far
    pivots = linkage.pivots.copy()
    finite = pivots[..., 2] != 0
    pivots[..., :2] *= np.where(finite, scale[:, None, None], 1)[..., None]
    crank = linkage.dyads[:, 0] == RR
    pivots[crank & (np.arange(400) % 3 == 0), 0, 1, :2] *= 0.03  # and from equal links to unequal ones
    linkage, _ = Linkage.valid(pivots)
    found = in_proportion(linkage)
    assert found.any()
    assert not found.all()
    assert found.tolist() == [could_be_built(linkage[i : i + 1]) for i in range(len(linkage))]
