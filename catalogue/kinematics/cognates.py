"""Cognates: other linkages whose coupler point runs along the same path.

With the complex ratio q = (P - A1*)/(A2* - A1*) of the coupler triangle, a four-bar has two: one
shares the fixed pivot A1, the other A2, and both have the third fixed pivot A1 + q (A2 - A1).  A
slider-crank has one, which shares the pivot of the crank; its slider runs along a line turned by
the angle of q.

Source: S. Roberts 1875, P. L. Chebyshev 1878.
"""

from __future__ import annotations

import numpy as np

from .linkage import PR, RR, Linkage, homogeneous
from .types import Complexes, Indices, Integers

#: Distance of a guided point from a moving pivot, over the coupler length, below which it has no
#: cognate: two pivots would coincide.
NEAREST = 1e-6


def cognates(linkage: Linkage, point: Complexes) -> tuple[Linkage, Indices, Integers]:
    """Compute Roberts' cognates of linkages with coupler points (n,), in the reference position.

    Returns
    -------
    Linkage, ndarray of int, shape (k,), ndarray of int, shape (k,)
        The cognates; the number of the original linkage of each; and 1 if the cognate shares the
        fixed pivot of the first crank, 2 for the second.
    """
    z, finite, kind = linkage.points, linkage.finite, linkage.dyads
    found, which, number = [], [], []
    for one, two in ((0, 1), (1, 0)):
        crank = (kind[:, one] == RR) & ((kind[:, two] == RR) | (kind[:, two] == PR))
        with np.errstate(all="ignore"):
            fixed, moving, other = z[:, one, 0], z[:, one, 1], z[:, two, 1]
            q = (point - moving) / (other - moving)
            good = crank & (np.abs(q) > NEAREST) & (np.abs(q - 1) > NEAREST)
            first = fixed + point - moving
            second = first + q * (moving - fixed)
            third = np.where(finite[:, two, 0], fixed + q * (z[:, two, 0] - fixed), q / np.abs(q) * z[:, two, 0])
        rows = np.flatnonzero(good)
        places = np.stack([np.stack([fixed, first], 1), np.stack([third, second], 1)], axis=1)[rows]
        found.append(homogeneous(places))
        found[-1][:, 1, 0, 2] = finite[rows, two, 0]
        which.append(rows)
        number.append(np.full(len(rows), one + 1))
    made, valid = Linkage.valid(np.concatenate(found))
    return made, np.concatenate(which)[valid], np.concatenate(number)[valid]
