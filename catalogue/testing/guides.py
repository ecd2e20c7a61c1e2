"""Guided elements: real pairs, the right ones, of the claimed order on the finite motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..curvature_theory.instant import Instant
from ..curvature_theory.leading_error import EXACT
from ..series.series import Guided, Member
from .base import Contract, apart, holds, real, whole
from .contact import EXACT_GAP, contact_order, largest_gap, taylor
from .sample import Sample, even


class GuideTest(NamedTuple):
    """Tolerance of equal pairs, and number of measured linkages."""

    same: float = 1e-6  #: largest distance of equal pairs
    #: the distance for principal pairs, which may have lost half of their digits
    double: float = 1e-3
    measured: int = 4  #: number of linkages per label


GUIDE_TEST = GuideTest()


class GuidesContract(Contract):
    """The claims of a series about its guided elements hold."""

    def test_guides_touch_the_finite_motion_to_their_order(self, member: Member) -> None:
        for sample in self.samples(member):
            for i, guides in _select_elements(sample).items():
                terms = taylor(sample.pivots[i], [g.pairs[i] for g in guides])
                gaps = largest_gap(sample.pivots[i], [g.pairs[i] for g in guides if np.asarray(g.order)[i] == EXACT])
                for g, c in zip(guides, terms, strict=True):
                    claimed, found = int(np.asarray(g.order)[i]), contact_order(c)
                    text = f"{sample.name(i)}: {g.label} claims contact of order {claimed}"
                    if claimed == EXACT:
                        gap = gaps.pop(0)
                        assert gap < EXACT_GAP, f"{text} (exact), but the finite motion leaves it by {gap:.2g}"
                    else:
                        assert found is not None, f"{text}, but the finite motion never leaves it; say EXACT"
                        assert found == claimed, f"{text}, but the finite motion leaves it like s^{found + 1}"

    def test_guides_are_pairs_apart_from_one_another_and_from_the_driving_ones(self, member: Member) -> None:
        for sample in self.samples(member):
            known = [(f"the driving pair {dyad + 1}", sample.pivots[:, dyad]) for dyad in (0, 1)]
            for g in sample.guided:
                whole(sample, g)
                for text, pairs in known:
                    unlike = ~(apart(g.pairs, pairs) < 1e-9)
                    holds(sample, unlike, f"{g.label} is {text}; give one of them as NaN")
                known.append((g.label, g.pairs))

    def test_each_guide_is_real_somewhere(self, member: Member) -> None:
        sample = even(self.series, member, 256).valid
        never = {g.label for g in sample.guided if not real(g).any()}
        declared = {label for key, label in self.absent if key == member.key}
        assert never == declared, f"{member.key}: NaN everywhere: {never}; declared in `absent`: {declared}"

    def test_principal_pairs_are_those_of_the_instant(self, member: Member) -> None:
        for sample in self.samples(member):
            principal = Instant(sample.linkage).curvature.principal_pairs
            high = [(g, (g.order >= 4) & real(g)) for g in sample.guided]
            clear = ~(apart(principal[:, 0], principal[:, 1]) < GUIDE_TEST.double) & np.isfinite(principal).all(
                (1, 2, 3)
            )
            known = [np.where(there[:, None, None], g.pairs, np.nan) for g, there in high]
            for j in (0, 1):
                near = [apart(principal[:, j], pairs) for pairs in (*known, sample.pivots[:, 0], sample.pivots[:, 1])]
                text = "no guided element of order 4 or more stands there; check where you give NaN"
                found = ~clear | (np.fmin.reduce(near) < GUIDE_TEST.same)
                holds(sample, found, "the principal pair {} is real, but " + text, principal[:, j].tolist())
            for g, there in high:
                near = [apart(principal[:, j], g.pairs) for j in (0, 1)]
                alien = clear & there & (g.order != EXACT) & ~(np.fmin.reduce(near) < GUIDE_TEST.same)
                holds(sample, ~alien, f"{g.label} is no principal pair of the instant")


def _select_elements(sample: Sample) -> dict[int, list[Guided]]:
    """Select the guided elements to measure: each one at its first real places, by linkage."""
    finite = [(g, real(g)) for g in sample.guided]
    numbers = sorted({int(i) for _, there in finite for i in np.flatnonzero(there)[: GUIDE_TEST.measured]})
    return {i: [g for g, there in finite if there[i]] for i in numbers}
