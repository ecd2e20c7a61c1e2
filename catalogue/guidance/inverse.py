"""The machine of a slot, traced as its inversion: fixed and moving plane exchanged.

A coupler that carries a slot over a fixed point is traced as its kinematic inversion, in which that
point runs along the slot; there the coupler stands still and the frame moves.  Both have the same
positions, seen from another plane: with the pose  z -> z + d + x (z - o)  of the traced motion, the
machine's is  z -> z + e + conj(x) (z - o)  with e = -conj(1 + x) d.  In the reference position the
two planes coincide.
"""

from __future__ import annotations

from ..kinematics.linkage import Linkage
from ..kinematics.motion import Pose


def of_machine(linkage: Linkage, pose: Pose) -> tuple[Linkage, Pose]:
    """Return the machines of traced inversions, and their poses about the origin of these.

    The fixed plane of an inversion is the coupler of the machine.

    Source: Allievi 1895, (the dual mechanism: meccanismo correlativo).
    """
    d, x, origin = pose
    return linkage.inverted(), Pose(-(1 + x).conj() * d, x.conj(), origin)
