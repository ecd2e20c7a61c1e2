"""What the parts of the contract share."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar

import numpy as np
import pytest

from ..kinematics.types import Array
from ..plugin.registry import Registry
from ..series.series import Guided, Member, Series
from .sample import Sample, chosen, even, rare

#: Largest residual of a linkage that was synthesised as a member.
MEMBER = 1e-9


class Contract:
    """The series under test; see `SeriesContract`."""

    series: ClassVar[Series]
    folders: ClassVar[Sequence[object]] = ()
    special: ClassVar[Mapping[str, Sequence[Mapping[str, float]]]] = {}
    absent: ClassVar[Collection[tuple[str, str]]] = ()

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Run each test for every member."""
        if "member" in metafunc.fixturenames:
            metafunc.parametrize("member", self.series.members, ids=[m.key for m in self.series.members])

    def samples(self, member: Member) -> list[Sample]:
        """Return the linkages of a member to test: an even sample, one of each configuration that it lacks, and the
        special points."""
        sample = even(self.series, member)
        share = np.mean(sample.faults == "")
        assert share > 0.5, f"{member.key}: {1 - share:.0%} of the domain gives no linkage: {set(sample.faults)}"
        points = self.special.get(member.key)
        lacking = rare(sample.valid)
        return [
            sample.valid,
            *([lacking] if lacking else []),
            *([chosen(self.series, member, points)] if points else []),
        ]

    def registry(self) -> Registry:
        """Return what the catalogue loads from the built-in plugins and from `folders`."""
        return Registry([str(place) for place in self.folders])


def belong(sample: Sample, residual: Array, margin: Array, where: str) -> None:
    """Assert that residuals and margins, shape (n,) each, are those of members."""
    wrong = ~(residual <= MEMBER)
    assert not wrong.any(), (
        f"{sample.name(first(wrong))}: residual {residual[first(wrong)]:.2g} {where}; "
        f"it must be 0 on the series, in the family {sample.member.family}"
    )
    wrong = ~(margin > 0)
    assert not wrong.any(), (
        f"{sample.name(first(wrong))}: margin {margin[first(wrong)]:.2g} {where}; "
        "it must be positive: keep the domain off other series"
    )


def whole(sample: Sample, g: Guided) -> None:
    """Assert that a guided element is a pair, or NaN."""
    nowhere = np.isinf(g.pairs).any((1, 2)) | (g.pairs == 0).all(-1).any(-1) | (g.pairs[..., 2] == 0).all(-1)
    i = first(nowhere)
    assert not nowhere.any(), (
        f"{sample.name(i)}: {g.label} is {g.pairs[i].tolist()}; at infinity means w = 0, "
        "(0, 0, 0) is no point, and of a pair at most one point may be at infinity"
    )


def first(where: object) -> int:
    """Return the number of the first true entry."""
    return int(np.argmax(np.asarray(where)))


def real(g: Guided) -> Array:
    """Return where a guided element is real, shape (n,)."""
    return np.asarray(np.isfinite(g.pairs).all((1, 2)))


def order_of(g: Guided) -> Array:
    """Return the claimed orders as an array."""
    return np.asarray(g.order)


def apart(p: Array, q: Array) -> Array:
    """Return how far apart pairs (n, 2, 3) are: the larger sine of the angles between homogeneous points."""
    with np.errstate(all="ignore"):
        p, q = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (p, q))
        return np.asarray(np.linalg.norm(np.cross(p, q), axis=-1).max(-1))
