"""Characteristics of function generators: output with derivatives, transmission angle."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ...errors import InvalidRequest
from ...given import instance
from .elements import Link, Revolute
from .frame import make_frame
from .motion import Motion
from .vectors import cross


def transmission(motion: Motion, output: str, link: str = "") -> pd.DataFrame:
    """Tabulate an output joint, its derivatives by the drive and the transmission angle.

    Parameters
    ----------
    motion : Motion
    output : str
        A body on any joint; the transmission angle needs a revolute joint on the ground.
    link : str, optional
        Name of the link that moves the output.  The transmission angle is the complement of the
        angle between the link and the velocity of its end on the output: 90 degrees at best, 0 at a
        dead point of the output.

    Raises
    ------
    InvalidRequest
        If there is no such body, link, or revolute joint.
    """
    instance("motion", motion, Motion), instance("link", link, str)
    value = motion.rows(motion.joint(output, order=3))
    angular = any(isinstance(x, Revolute) and x.body == output for x in motion.mechanism.elements)
    unit, drive = "deg" if angular else motion.mechanism.unit, motion.drive_unit
    scale = np.degrees(1.0) if angular else 1.0
    by = np.degrees(1.0) if drive == "deg" else 1.0
    columns = {f"{output} [{unit}]": value[:, 0] * scale}
    for k, name in enumerate(("first", "second", "third"), 1):
        power = "" if k == 1 else f"^{k}"
        columns[f"{name} derivative [{unit}/{drive}{power}]"] = value[:, k] * scale / by**k
    if link:
        rod = next((x for x in motion.mechanism.elements if isinstance(x, Link) and x.name == link), None)
        arm = next(
            (x for x in motion.mechanism.elements if type(x) is Revolute and x.body == output and x.on == "ground"),
            None,
        )
        if rod is None or arm is None or output not in (rod.a, rod.b):
            raise InvalidRequest(
                f"a transmission angle needs a link {link!r} to {output} on a revolute joint on the ground"
            )
        ends = motion.rows(motion.point(rod.a, rod.from_)), motion.rows(motion.point(rod.b, rod.to))
        at = motion.each(arm.at, "the output's joint")
        axis = motion.each(arm.to, "its axis") - at if arm.axis is None else motion.each(arm.axis, "its axis")
        pin = ends[0] if rod.a == output else ends[1]
        e, v = ends[1] - ends[0], cross(np.broadcast_to(axis, pin.shape), pin - at)
        sine = np.abs((e * v).sum(1)) / np.sqrt((e * e).sum(1) * (v * v).sum(1))
        columns["transmission angle [deg]"] = np.degrees(np.arcsin(np.clip(sine, 0, 1)))
    return make_frame(motion, columns)
