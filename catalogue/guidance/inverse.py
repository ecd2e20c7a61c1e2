"""The machine of a slot, whose inverse is traced: fixed and moving plane exchanged, along the same motion.

A coupler that carries a slot over a fixed point is traced as its kinematic inversion, in which that point runs along
the slot; there the coupler stands still and the frame moves.  Both have the same positions, seen from another plane:
with the pose  z -> z + d + x (z - o)  of the traced motion, the machine's is  z -> z + e + conj(x) (z - o)  with
e = -conj(1 + x) d.  In the reference position the two planes coincide.
"""

from __future__ import annotations

from ..kinematics.linkage import Linkage
from ..kinematics.motion import Pose


def of_machine(linkage: Linkage, pose: Pose) -> tuple[Linkage, Pose]:
    """Return the machines of traced inversions, what is fixed in these being their coupler, and their poses about the
    same origin.

    Source: Allievi 1895, (the dual mechanism: meccanismo correlativo).
    """
    d, x, origin = pose
    return linkage.inverted(), Pose(-(1 + x).conj() * d, x.conj(), origin)
