"""Linkages with a slot, traced as their inversions: fixed and moving plane exchanged.

A coupler that carries a slot over a fixed point is traced as its kinematic inversion: there the
point runs along the slot, the coupler stands still and the frame moves.  Both have the same
positions, seen from another plane.  If the pose of the traced motion is  z -> z + d + x (z - o),
that of the linkage is  z -> z + e + conj(x) (z - o)  with e = -conj(1 + x) d.  In the reference
position the two planes coincide.
"""

from __future__ import annotations

from ..kinematics.linkage import Linkage
from ..kinematics.motion import Pose


def of_machine(linkage: Linkage, pose: Pose) -> tuple[Linkage, Pose]:
    """Invert traced inversions back: return the linkages, and their poses about their origin.

    The fixed plane of an inversion is the coupler of the linkage.

    Source: Allievi 1895, (the dual mechanism: meccanismo correlativo).
    """
    d, x, origin = pose
    return linkage.inverted(), Pose(-(1 + x).conj() * d, x.conj(), origin)
