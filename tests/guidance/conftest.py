"""Guides to measure: stored series' members, with what they guide."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.reach import Ladder, scan
from catalogue.kinematics.linkage import Linkage
from catalogue.plugin.registry import Registry


@pytest.fixture(scope="session")
def drawn() -> Callable[..., tuple[CouplerCurve, np.ndarray]]:
    """Return a maker of guides of all series: those with a straight line, or a circle, and their order of contact."""

    @cache
    def make(circle: bool) -> tuple[CouplerCurve, np.ndarray]:
        from catalogue.populate.elements import points as points_of
        from catalogue.series.sampling import draw

        linkages, points, orders = [], [], []
        for series in Registry().series.values():
            for member in series.members:
                these = draw(series, member, seed=9, number=0)
                found = points_of(series, these, "circle" if circle else "line")
                some = np.arange(len(found["mechanism"]))[::97]
                linkages.append(these.linkage.pivots[found["mechanism"][some].astype(int)])
                points.append((found["x"] + 1j * found["y"])[some])
                orders.append(found["contact_order"][some])
        guides = coupler_curve(Linkage(np.concatenate(linkages)), np.concatenate(points))
        usable = guides.extent.min(0) > 0.01
        return guides[usable], np.concatenate(orders)[usable]

    return make


@pytest.fixture(scope="session")
def scanned(drawn: Callable[..., tuple[CouplerCurve, np.ndarray]]) -> Callable[[bool], Ladder]:
    """Return the ladders of the guides that `drawn` makes."""

    @cache
    def make(circle: bool) -> Ladder:
        guides, order = drawn(circle)
        return scan(guides, circle=circle, three=(order == 4) & (not circle))

    return make
