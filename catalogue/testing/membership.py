"""Synthesis, classification and inversion: arrays, frame, round trip, edges of the domain."""

from __future__ import annotations

import numpy as np
import pytest

from ..curvature_theory.analysis import PARALLEL, REGULAR
from ..curvature_theory.instant import Instant
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array
from ..series.series import Member, inverse_family
from .base import MEMBER, Contract, belong, holds, whole
from .sample import Sample, corners, even

#: Largest error of the canonical frame.
FRAME = 1e-6


class MembershipContract(Contract):
    """Synthesised linkages are members in any frame and batch.

    Their inverses are members of the inverse series.
    """

    def test_linkages_are_members(self, member: Member) -> None:
        for sample in self.samples(member):
            instant = Instant(sample.linkage)
            belong(sample, *self.series.classify(instant), "in the canonical frame")
            holds(sample, sample.linkage.family == member.family, "it is a {}", sample.linkage.family)

    def test_membership_does_not_depend_on_the_frame(self, member: Member) -> None:
        draw = np.random.default_rng(67)
        for sample in self.samples(member):
            n = len(sample.linkage)
            scale = 10 ** draw.uniform(-3, 3, n) * np.exp(2j * np.pi * draw.random(n))
            shift = np.abs(scale) * (draw.normal(size=n) + 1j * draw.normal(size=n))
            moved = sample.linkage.moved(scale, shift, draw.random(n) < 0.5)
            residual, margin = self.series.classify(Instant(moved))
            belong(sample, residual, margin, "after a similarity or a mirror image")
            _, before = self.series.classify(Instant(sample.linkage))
            text = "its margin is {:.6g}, but {:.6g} after a similarity or mirror image; make it dimensionless"
            holds(sample, np.isclose(margin, before, rtol=1e-4, atol=1e-9), text, before, margin)

    def test_frame_is_canonical(self, member: Member) -> None:
        for sample in self.samples(member):
            at = Instant(sample.linkage, np.zeros(len(sample.linkage), complex)).curvature
            regular, parallel = at.state == REGULAR, at.state == PARALLEL
            turned = np.abs(np.abs(at.axes[:, 0, 0]) - 1)
            faults = {
                "its pole is not at the origin": np.abs(at.pole).max(-1) * (regular | parallel),
                "the diameter of its inflection circle is not 1": np.where(regular, np.abs(at.rho0 - 1), 0),
                "its inflection pole is not (0, 1)": np.where(regular, np.abs(at.axes[:, 1] - [0, 1]).max(-1), 0),
                "its x axis does not run along the parallel cranks": np.where(parallel, turned, 0),
            }
            for text, error in faults.items():
                holds(sample, error <= FRAME, text + " (off by {:.2g})", error)

    def test_arrays_have_the_shapes_and_types_of_the_contract(self, member: Member) -> None:
        sample = even(self.series, member)
        n = len(sample.pivots)
        array_is(f"{member.key}: pivots", member.pivots(member.complete(sample.free)), (n, 2, 2, 3))
        labels = []
        for g in self.series.guided(member.complete(sample.free)):
            labels.append(g.label)
            array_is(f"{member.key}: pairs of {g.label}", g.pairs, (n, 2, 3))
            order = np.asarray(g.order)
            assert order.shape in ((), (n,)), f"{member.key}: order of {g.label} has shape {order.shape}, not ({n},)"
            assert order.dtype.kind == "i", f"{member.key}: order of {g.label} is {order.dtype}, not an integer"
        assert len(set(labels)) == len(labels), f"{member.key}: two guided elements have one label: {labels}"
        valid = sample.valid
        for name, values in zip(("residual", "margin"), self.series.classify(Instant(valid.linkage)), strict=True):
            array_is(f"{member.key}: {name}", values, (len(valid.linkage),))

    def test_a_linkage_does_not_depend_on_its_batch(self, member: Member) -> None:
        many = even(self.series, member).valid
        for i in range(0, len(many.linkage), 16):
            one = many.part(np.array([i]))
            for text, single, row in rows(many, one, i):
                same = np.allclose(single, row, rtol=1e-12, atol=1e-14, equal_nan=True)
                assert same, f"{many.name(i)}: {text} alone is {single.tolist()}, in a batch {row.tolist()}"

    def test_same_parameters_give_the_same_bits(self, member: Member) -> None:
        first, second = even(self.series, member), even(self.series, member)
        again = [first.pivots, *(g.pairs for g in first.guided)], [second.pivots, *(g.pairs for g in second.guided)]
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(*again, strict=True)), (
            f"{member.key}: two calls with the same parameters differ; use no random numbers and no state"
        )

    def test_edges_of_the_domain_give_linkages_or_named_faults(self, member: Member) -> None:
        sample = corners(self.series, member)
        finite = np.isfinite(sample.pivots).all(axis=(1, 2, 3))
        holds(sample, finite, "NaN or infinite pivots; narrow the domain, or use w = 0")
        good = sample.valid
        assert len(good.pivots), f"{member.key}: no corner of the domain gives a linkage: {set(sample.faults)}"
        residual, _ = self.series.classify(Instant(good.linkage))
        holds(good, residual <= MEMBER, "residual {:.2g} at this corner", residual)
        for g in good.guided:
            whole(good, g)

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
        once = even(self.series, member).valid
        again = Sample(twice, back, once.free)
        assert np.array_equal(once.pivots, again.pivots)
        for a, b in zip(once.guided, again.guided, strict=True):
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


def array_is(name: str, values: object, shape: tuple[int, ...]) -> None:
    assert isinstance(values, np.ndarray), f"{name}: {type(values).__name__}, not an array"
    assert values.shape == shape, f"{name}: shape {values.shape}, not {shape}"
    assert values.dtype == np.float64, f"{name}: {values.dtype}, not float64"


def rows(many: Sample, one: Sample, i: int) -> list[tuple[str, Array, Array]]:
    """Pair results for a linkage alone with those for row i of a batch."""
    found = [("its pivots", one.pivots[0], many.pivots[i])]
    for g, h in zip(many.guided, one.guided, strict=True):
        found += [
            (g.label, h.pairs[0], g.pairs[i]),
            (f"order of {g.label}", np.asarray(h.order)[0], np.asarray(g.order)[i]),
        ]
    batch, single = (s.series.classify(Instant(Linkage(s.pivots))) for s in (many, one))
    return [*found, ("its margin", single[1][0], batch[1][i])]
