"""Planar chains of many bars, moved in closed form, group by group.

`structure` says which bars share which joints and finds the groups in which they close: dyads,
gears, bars kept parallel.  `chain` adds the positions of the joints, for a batch.  `poses` closes
the groups, `rates` has velocities, accelerations and derivatives by the reference pose, `circuits`
follows the motion through dead and change points.  `given` reads a chain from plain data.  Import
from the modules.
"""
