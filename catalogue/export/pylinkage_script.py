"""Write a guide as a script for pylinkage, which moves it and asserts its deviation.

From position to position pylinkage closes a dyad in the assembly nearer to the last position. That
is right as long as the two assemblies stay apart: without a dead point of the driving crank or a
change point in the stroke. Otherwise no script is written, nor for families whose dyads pylinkage
lacks.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from .. import __version__
from ..errors import InvalidRequest
from ..guides.kinds import is_candidate
from ..kinematics.linkage import RR
from ..kinematics.types import Complexes

if TYPE_CHECKING:
    from ..guides.guide_motion import GuideMotion
    from ..guides.placed import PlacedGuide
    from .formats import Options


class ScriptOptions(NamedTuple):
    """Positions and tolerances of the script."""

    steps: int = 721  #: number of positions of the crank over the stroke
    #: Largest step of the dyad's joint between two positions, over the distance of its two
    #: assemblies.
    near: float = 0.2
    #: permitted relative difference of the deviation, which the script computes at the stations of
    #: a table
    off: float = 0.01
    rounding: float = 1e-12  #: permitted absolute difference by rounding [longest length]
    #: Permitted difference of the distance between the ends of wide arcs [deviations]: each end is
    #: off by one deviation across the arc, and along it by as much as the fitted circle, whose
    #: centre determines the angle.
    wide: int = 6


LIMITS = ScriptOptions()


SCRIPT = '''\
"""A guide ({family}) of mechanism-catalogue {version}, moved by pylinkage over its stroke{unit}."""

import math

import numpy as np
from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, {dyad}
from pylinkage.simulation import Linkage

STROKE = {stroke!r}
DEVIATION = {deviation!r}  # {meaning}
STEPS = {steps}
START, END = {start!r}, {end!r}  # of the crank's angle [rad]

pivot = Ground({pivot}, name="A{crank}")
{grounds}
step = (END - START) / (STEPS - 1)
crank = Crank(anchor=pivot, radius={radius!r}, angular_velocity=step, initial_angle=START - step, name="crank")
{joint}
point = FixedDyad(anchor1=crank.output, anchor2=joint, distance={distance!r}, angle={angle!r}, name="point")
linkage = Linkage([pivot, {listed}, crank, joint, point], name="guide")

path = np.array([complex(*places[-1]) for places in linkage.step(iterations=STEPS)])


{measure}


deviation = deviation_of(path)
stroke = abs(path[-1] - path[0])
print(f"stroke {{stroke:.9g}}, deviation {{deviation:.6g}}")
assert abs(deviation - DEVIATION) <= {off!r} * DEVIATION + {rounding!r}, (deviation, DEVIATION)
assert abs(stroke - STROKE) <= {share}DEVIATION + {rounding!r}, (stroke, STROKE)
'''

LINE = '''\
def deviation_of(z):
    """Half the width of the narrowest strip that holds the path: convex in the slope of the strip."""
    w = (z - z[0]) / (z[-1] - z[0]) * abs(z[-1] - z[0])
    low, high = -0.5, 0.5
    for _ in range(200):
        left, right = low + (high - low) / 3, high - (high - low) / 3
        if np.ptp(w.imag - left * w.real) < np.ptp(w.imag - right * w.real):
            high = right
        else:
            low = left
    slope = 0.5 * (low + high)
    return 0.5 * np.ptp(w.imag - slope * w.real) * math.cos(math.atan(slope))'''

ARC = '''\
def deviation_of(z):
    """Largest distance from the arc about the centre of the best-placed circle."""
    return np.abs(np.abs(z - {centre!r}) - {radius!r}).max()'''


def script(guide: PlacedGuide, options: Options) -> str:
    """Return the script.

    Raises
    ------
    InvalidRequest
        If the guide has no stroke, is no four-bar or slider-crank, or none of its cranks drives it
        over the stroke without coming near a dead point or a change point.
    """
    family = str(guide.linkage.family[0])
    if family not in ("four-bar", "slider-crank"):
        raise InvalidRequest(f"pylinkage has no dyads for a guide of family {family}: only four-bars and slider-cranks")
    if not is_candidate(guide):
        raise InvalidRequest("a script for pylinkage asserts a deviation: export an answer of `find` or `measure`")
    if guide.pole is not None or guide.span().cusp.any():
        raise InvalidRequest("this guide passes a change point, or returns: pylinkage would leave its branch there")
    moved, crank = _best_driven_motion(guide)
    z, kinds = guide.linkage.points[0], guide.linkage.dyads[0]
    other = 1 - crank
    start = np.radians(moved.drive)
    first = {name: complex(path[0]) for name, path in moved.points.items()}
    pin, joint = first[f"A{crank + 1}*"], first[f"A{other + 1}*"]
    place = (first["guided"] - pin) / (joint - pin)
    coupler = abs(joint - pin)
    if kinds[other] == RR:
        grounds = f'other = Ground({_xy(z[other, 0])}, name="A{other + 1}")'
        dyad = f"RRRDyad(crank.output, other, {coupler!r}, {float(abs(joint - z[other, 0]))!r}"
        listed = "other"
    else:
        along = 1j * z[other, 0] * guide.linkage.size[0]
        grounds = f'low = Ground({_xy(joint - along)}, name="low")\nhigh = Ground({_xy(joint + along)}, name="high")'
        dyad = f"RRPDyad(crank.output, low, high, {coupler!r}"
        listed = "low, high"
    meaning, measure, longest = "half the width of the narrowest strip", LINE, float(guide.linkage.size[0])
    if guide.radius is not None:
        meaning = f"from the best-placed arc of radius {guide.radius:.9g}"
        centre = _fit_centre(moved.points["guided"], guide.radius, moved.deviation)
        measure, longest = ARC.format(centre=centre, radius=guide.radius), longest + guide.radius
    return SCRIPT.format(
        family=family,
        version=__version__,
        unit=f"; lengths in {options.unit}" if options.unit else "",
        dyad=dyad.partition("(")[0],
        stroke=guide.stroke,
        deviation=guide.deviation,
        meaning=meaning,
        steps=LIMITS.steps,
        start=float(start[0]),
        end=float(start[-1]),
        pivot=_xy(z[crank, 0]),
        crank=crank + 1,
        grounds=grounds,
        radius=float(abs(z[crank, 1] - z[crank, 0])),
        joint=f'joint = {dyad}, x={joint.real!r}, y={joint.imag!r}, name="joint")',
        listed=listed,
        share=f"{LIMITS.wide} * " if guide.is_wide else "",
        distance=float(abs(place) * coupler),
        angle=float(np.angle(place)),
        measure=measure,
        off=LIMITS.off,
        rounding=LIMITS.rounding * longest,
    )


def _best_driven_motion(guide: PlacedGuide) -> tuple[GuideMotion, int]:
    """Return the motion over the stroke by the crank that drives best, and its index."""
    found = []
    for i in np.flatnonzero(guide.linkage.dyads[0] == RR).tolist():
        moved = guide.motion(LIMITS.steps, driver=i + 1)
        turned = np.diff(moved.drive)
        if (turned > 0).all() or (turned < 0).all():
            found.append((_closest_approach(guide, moved, i), i, moved))
    if not found or min(found, key=lambda one: one[0])[0] > LIMITS.near:
        raise InvalidRequest(
            "no crank drives this guide over its stroke without coming near a dead point or a change point: pylinkage "
            "would leave its branch there"
        )
    _, crank, moved = min(found, key=lambda one: one[0])
    return moved, crank


def _closest_approach(guide: PlacedGuide, moved: GuideMotion, crank: int) -> float:
    """Return the largest step of the other dyad's joint over the distance of assemblies."""
    other, z = 1 - crank, guide.linkage.points[0]
    pin, joint = moved.points[f"A{crank + 1}*"], moved.points[f"A{other + 1}*"]
    step = np.abs(np.diff(joint)) / np.abs(np.diff(moved.drive)) * np.abs(np.ptp(moved.drive)) / (LIMITS.steps - 1)
    if guide.linkage.dyads[0, other] == RR:
        axis = z[other, 0] - pin
        apart = 2 * np.abs(((joint - pin) * axis.conj()).imag) / np.abs(axis)
    else:
        apart = 2 * np.abs(((joint - pin) * (1j * z[other, 0]).conjugate()).real)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nan_to_num(step / np.minimum(apart[1:], apart[:-1]), nan=0.0).max())


def _fit_centre(z: Complexes, radius: float, deviation: Any) -> complex:
    """Fit the centre of the circle with given distances of points (m,), positive to the left."""
    chord = z[-1] - z[0]
    middle, along = 0.5 * (z[0] + z[-1]), chord / abs(chord)
    top = ((z[len(z) // 2] - middle) * along.conjugate()).imag
    # the arc bulges to the left, its centre is to the right; the centre of a wide arc is behind the
    # chord
    side = 1.0 if top > 0 else -1.0
    depth = math.sqrt(max(radius**2 - (0.5 * abs(chord)) ** 2, 0.0)) * (1 if abs(top) <= 0.5 * abs(chord) else -1)
    start = middle - side * 1j * along * depth

    def off(shift: Any) -> Any:
        return np.abs(z - start - complex(*shift)) - radius - side * deviation

    found = least_squares(off, [0.0, 0.0], x_scale=abs(chord), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return complex(start + complex(*found.x))


def _xy(z: complex) -> str:
    return f"{float(z.real)!r}, {float(z.imag)!r}"
