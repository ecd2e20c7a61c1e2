"""Fixtures and assertions that the parts of the contract share."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar

import numpy as np
import pytest

from ..kinematics.types import Array, Floats, Mask
from ..plugin.registry import Registry
from ..series.series import Guided, Member, Series
from .sample import Sample, chosen, even, rare

#: Largest residual of a linkage synthesised as a member.
MEMBER = 1e-9


#: Samples by the class of tests and the member.
_DRAWN: dict[tuple[type, str], list[Sample]] = {}


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
        """Draw the linkages of a member to test, once.

        They are an even sample, one linkage of each configuration that it lacks, and the special
        points.
        """
        known = _DRAWN.get((type(self), member.key))
        if known is not None and known[0].series is self.series and known[0].member is member:
            return known
        sample = even(self.series, member)
        share = np.mean(sample.faults == "")
        assert share > 0.5, f"{member.key}: {1 - share:.0%} of the domain gives no linkage: {set(sample.faults)}"
        points = self.special.get(member.key)
        special = chosen(self.series, member, points) if points else None
        found = [one for one in (sample.valid, rare(sample.valid), special) if one is not None]
        _DRAWN[type(self), member.key] = found
        return found

    def registry(self) -> Registry:
        """Load the built-in plugins and those of `folders`."""
        return Registry([str(place) for place in self.folders])


def holds(sample: Sample, good: object, text: str, *values: Sequence[object] | Array) -> None:
    """Assert that a condition holds for all linkages, shape (n,).

    The message is `text`, formatted with the values of the first linkage that fails.
    """
    wrong = np.flatnonzero(~np.asarray(good))
    if wrong.size:
        said = text.format(*(value[wrong[0]] for value in values)) if values else text
        raise AssertionError(f"{sample.name(wrong[0])}: {said}")


def belong(sample: Sample, residual: Floats, margin: Floats, where: str) -> None:
    """Assert that residuals and margins, shape (n,) each, are those of members."""
    must = f"it must be 0 on the series, in the family {sample.member.family}"
    holds(sample, residual <= MEMBER, f"residual {{:.2g}} {where}; {must}", residual)
    must = "it must be positive: keep the domain off other series"
    holds(sample, margin > 0, f"margin {{:.2g}} {where}; {must}", margin)


def whole(sample: Sample, g: Guided) -> None:
    """Assert that guided elements are valid pairs, or NaN."""
    nowhere = np.isinf(g.pairs).any((1, 2)) | (g.pairs == 0).all(-1).any(-1) | (g.pairs[..., 2] == 0).all(-1)
    means = "at infinity means w = 0, (0, 0, 0) is no point, and of a pair at most one point may be at infinity"
    holds(sample, ~nowhere, "{} is {}; " + means, [g.label] * len(nowhere), g.pairs.tolist())


def real(g: Guided) -> Mask:
    """Tell where a guided element is real, shape (n,)."""
    return np.asarray(np.isfinite(g.pairs).all((1, 2)))


def apart(p: Floats, q: Floats) -> Floats:
    """Measure the distance of pairs (n, 2, 3).

    It is the larger sine of the angles between their homogeneous points.
    """
    with np.errstate(all="ignore"):
        p, q = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (p, q))
        return np.asarray(np.linalg.norm(np.cross(p, q), axis=-1).max(-1))
