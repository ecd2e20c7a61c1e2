"""Inversion: the inverse series is the series of the inverted linkages."""

from __future__ import annotations

import numpy as np
import pytest

from ..curvature_theory.instant import Instant
from ..series.series import Member, inverse_family
from .base import Contract, belong
from .sample import Sample, even


class InverseContract(Contract):
    """Fixed and moving plane can be exchanged in everything."""

    def test_inverse_has_the_inverted_members(self, member: Member) -> None:
        inverse = self.series.inversion(self.series.inverse, "inverse")
        twin = inverse.members[self.series.members.index(member)]
        assert twin.family == inverse_family(member.family)
        sample = even(self.series, member).valid
        inverted = Sample(inverse, twin, sample.free)
        swapped = sample.pivots[:, :, ::-1] * [-1, -1, 1]
        assert np.array_equal(inverted.pivots, swapped), f"{member.key}: the inverse is not the linkage inverted"
        given, there = (self.series.classify(Instant(sample.linkage)), inverse.classify(Instant(inverted.linkage)))
        for name, a, b in zip(("residual", "margin"), given, there, strict=True):
            assert np.allclose(a, b, rtol=1e-6, atol=1e-9), f"{member.key}: inversion changes the {name}"
        if self.series.inverse == self.series.code:
            belong(sample, *self.series.classify(Instant(inverted.linkage)), "inverted (it is its own inverse)")

    def test_inversion_twice_changes_nothing(self, member: Member) -> None:
        twice = self.series.inversion(self.series.inverse, "inverse").inversion(self.series.code, self.series.title)
        back = twice.members[self.series.members.index(member)]
        assert (back.key, twice.inverse) == (member.key, self.series.inverse)
        first, again = even(self.series, member).valid, Sample(twice, back, even(self.series, member).valid.free)
        assert np.array_equal(first.pivots, again.pivots)
        for a, b in zip(first.guided, again.guided, strict=True):
            assert a.label == b.label
            assert np.array_equal(a.pairs, b.pairs, equal_nan=True), f"{member.key}: {a.label} inverted twice differs"

    def test_registered_inverse_recognises_the_inversions(self, member: Member) -> None:
        series = self.registry().series
        if self.series.inverse not in series:
            pytest.skip(f"no plugin provides {self.series.inverse}")
        twin = series[self.series.inverse]
        assert twin.inverse == self.series.code, f"the inverse of {twin.code} is {twin.inverse}, not {self.series.code}"
        sample = even(self.series, member).valid
        belong(sample, *twin.classify(Instant(sample.linkage.inverted())), f"inverted, as a member of {twin.code}")
