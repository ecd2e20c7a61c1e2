"""Configurations: positions of the pivots of each dyad relative to the pole axes."""

from __future__ import annotations

import numpy as np

from ..kinematics.linkage import PR, RP, Linkage
from ..kinematics.types import Texts
from .analysis import DEGENERATE, PARALLEL, REGULAR, Curvature
from .finite_pole import distances

#: Distance from the pole below which a pivot stands at the pole [sizes of the linkage].
AT_POLE = 1e-9
#: Letters in the order in which a configuration names its two dyads.
LETTERS = "DVTCPXN"


def configuration(linkage: Linkage, instant: Curvature) -> Texts:
    """Name the configuration of each linkage by the letters of its two dyads, shape (n,).

    P: both pivots on the side of the inflection circle; X: the pole between them; N: both on the
    other side; D (V): moving (fixed) pivot at the pole; T: slider; C: slide.  Parallel cranks:
    ``equal`` or ``opposite`` sense, ``single`` for one crank.  Dead points, unless the instant is
    that of one branch: ``dead-point``.

    Source: Allievi 1895, sec. 12 and Table of configurations, by the signs of 1/r and 1/r*.
    """
    names = np.full(len(linkage), "dead-point", dtype="<U10")
    regular = np.flatnonzero(instant.state == REGULAR)
    if regular.size:
        some = linkage[regular]
        pole = instant.pole[regular, 0] + 1j * instant.pole[regular, 1]
        normal = instant.axes[regular, 1, 0] + 1j * instant.axes[regular, 1, 1]
        # at a dead point the rays do not determine the pole: take the distances from it directly
        plain = (some.rays[:, :, None].conj() * (some.points - pole[:, None, None])).real
        plain = np.where(some.finite, plain, np.inf)
        dead = np.abs(some.sine)[:, None] < DEGENERATE.dead_sine
        r, r_star = (np.where(dead, plain[..., i], along) for i, along in enumerate(distances(some, pole)[:2]))
        up = np.where((some.rays * normal[:, None].conj()).real < 0, -1.0, 1.0)
        letter = np.where(r * up > 0, "P", np.where(r_star * up > 0, "X", "N"))
        near = AT_POLE * some.size[:, None]
        letter = np.where(np.abs(r_star) < near, "D", np.where(np.abs(r) < near, "V", letter))
        letter = np.where(some.dyads == PR, "T", np.where(some.dyads == RP, "C", letter))
        place = (letter[..., None] == np.array(list(LETTERS))).argmax(-1)
        letter = np.take_along_axis(letter, np.argsort(place, axis=1, kind="stable"), 1)
        names[regular] = np.char.add(letter[:, 0], letter[:, 1])
    parallel = np.flatnonzero(instant.state == PARALLEL)
    if parallel.size:
        some = linkage[parallel]
        across = np.stack([-some.rays[:, 0].imag, some.rays[:, 0].real], axis=-1)
        origin = np.einsum("nk,nk->n", instant.pole[parallel], across)
        middle = np.where(some.finite, some.points, 0).sum(-1) / some.finite.sum(-1)
        height = middle.real * across[:, :1] + middle.imag * across[:, 1:] - origin[:, None]
        cranks = (some.dyads == 0).all(1)
        names[parallel] = np.where(cranks, np.where(height[:, 0] * height[:, 1] > 0, "equal", "opposite"), "single")
    return names
