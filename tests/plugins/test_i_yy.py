"""Series I.yy: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.testing import SeriesContract, load
from catalogue.testing.sample import even

I_YY = load("I.yy")


class TestIyy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = I_YY
    absent: ClassVar = [
        ("slider-crank general", "undulation"),
        ("inverted-slider-crank general", "cuspidation"),
        ("swinging-block general", "[1]"),
        ("swinging-block general", "[2]"),
        ("swinging-block general", "undulation"),
        ("swinging-block general", "cuspidation"),
    ]


@pytest.mark.parametrize("series", [I_YY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 7


def test_configurations_are_those_of_the_branch() -> None:
    """The pairs stand at 1/q and 1/(q + 1) on the pole normal: P for q > 0, X between 0 and -1, N below, T at 0."""
    for member in I_YY.members:
        sample = even(I_YY, member).valid
        complete = member.complete(sample.free)
        pole = np.zeros(len(sample.linkage), dtype=complex)
        for name, *letters in zip(
            Instant(sample.linkage, pole).configuration,
            *(np.select([q == 0, q == -1, q > 0, q > -1], [*"TCPX"], "N") for q in (complete["q3"], complete["q4"])),
            strict=True,
        ):
            assert sorted(name) == sorted(letters)
    assert set(Instant(sample.linkage).configuration) == {"dead-point"}
