"""What is held while a guide is moved."""

from __future__ import annotations

import numpy as np

from catalogue.kinematics.linkage import Linkage
from catalogue.refine.held import HeldLengths

ROCKERS = [[(0, 0, 1), (1, 2, 1)], [(3, 0, 1), (2.5, 1.8, 1)]]
SLIDER = [[(0, 0, 1), (1, 2, 1)], [(0, 1, 0), (2.5, 1.8, 1)]]


def test_fixed_pivots_are_drawn_back_to_the_edge_of_where_they_may_be() -> None:
    """Those that are within stay, and so does all else, the direction of a slide among it."""
    moved = np.array([ROCKERS, ROCKERS, SLIDER], float)
    moved[0, :, 0, :2] = (0.3, 0.4), (3.0, -0.09)
    moved[1, :, 0, :2] = (-0.06, 0.08), (5.0, 0.0)
    moved[2, 0, 0, :2] = (0.0, -7.0)
    held = HeldLengths({}, places=np.array([0j, 3 + 0j]), within=0.1)
    back = held._drawn_back(Linkage.trusted(moved.copy())).pivots
    expected = moved.copy()
    expected[0, 0, 0, :2], expected[1, 1, 0, :2], expected[2, 0, 0, :2] = (0.06, 0.08), (3.1, 0), (0, -0.1)
    np.testing.assert_allclose(back, expected, atol=1e-15)
