"""Layers of an animated drawing: theory, velocity, names of pivots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from ..curvature_theory.analysis import curvature
from ..curvature_theory.finite_pole import finite_pole
from ..guides.kinds import has_bars
from ..kinematics.linkage import PR, RP, Linkage, homogeneous
from ..kinematics.sampling import halved, off_chord
from ..kinematics.types import Complexes, Floats, Mask, Scalar
from ..markup import NOTHING, Markup, element
from .chain_poses import chain_poses
from .cubics import cubic
from .frame import Frame
from .moving_style import LAYER_NAMES
from .svg import Clock, group, number, pair, polyline
from .svg_machine import svg_names

if TYPE_CHECKING:
    from ..guides.kinds import Guide
    from ..guides.placed import PlacedGuide

#: Names of layers that can be requested, from the back to the front.
LAYERS = LAYER_NAMES


#: Layers of a mechanism of many bars, for which no curvature is computed.
CHAIN_LAYERS = ("turn", "velocity", "names")


class LayerOptions(NamedTuple):
    """Sizes of the layers of a moving drawing."""

    #: radius above which an inflection circle is omitted [widths of the drawing]
    widest: float = 8.0
    arrow: float = 0.22  #: length of the longest arrow of the velocity [widths]
    #: largest error of a centrode [widths]: a third of a pixel of a card
    centrode_error: float = 1e-3


LAYER = LayerOptions()


def layers_of(guide: Guide) -> tuple[str, ...]:
    """Return the names of the layers that a guide can have."""
    return CHAIN_LAYERS if has_bars(guide) else LAYERS


@dataclass(frozen=True)
class Layers:
    """Draws layers of poses in a frame."""

    guide: Guide
    shown: Any  #: `Poses`, or `ChainPoses` of many bars
    frame: Frame
    clock: Clock

    def drawn(self, name: str) -> Markup:
        """Return a layer by its name."""
        draw = {
            "turn": self._turn,
            "circle": self._circle,
            "cubics": self._cubics,
            "centrodes": self._centrodes,
            "pole": self._pole,
            "velocity": self._velocity,
            "names": self._names,
        }[name]
        return group(f"layer {name}", draw())

    @property
    def _linkage_guide(self) -> PlacedGuide:
        """The guide, for layers that exist only for linkages of two dyads."""
        return cast("PlacedGuide", self.guide)

    def _pole(self) -> Markup:
        pole, _ = self._instants
        seen = self.frame.near(pole, 0.5)
        if not seen.any():
            return NOTHING
        r = 4.5 * self.frame.point
        cross = polyline(np.array([-r, r, np.nan, -1j * r, 1j * r]))
        sign = element("circle", class_="theory", r=number(0.6 * r)) + element("path", class_="theory", d=cross)
        moved = self.clock.moved(self.frame.at(_fill_invisible(pole, seen)), "sign", sign)
        return element("g", self._visibility_animation(seen), moved, **self._still_opacity(seen))

    def _circle(self) -> Markup:
        pole, diameter = self._instants
        radius: Floats = 0.5 * np.abs(diameter) * self.frame.scale
        seen = np.asarray(radius < LAYER.widest * self.frame.width)
        if not seen.any():
            return NOTHING
        centre, radius = _fill_invisible(self.frame.at(pole + 0.5 * diameter), seen), _fill_invisible(radius, seen)
        values = {
            "cx": [number(z.real) for z in centre],
            "cy": [number(z.imag) for z in centre],
            "r": [number(r) for r in radius],
        }
        now = {name: each[self.clock.middle] for name, each in values.items()}
        moves = [self.clock.animate(name, each) for name, each in values.items()]
        return element(
            "circle", *moves, self._visibility_animation(seen), class_="theory", **now, **self._still_opacity(seen)
        )

    def _centrodes(self) -> Markup:
        """Return both centrodes: one rolls upon the other and carries the coupler with it."""
        run = self._linkage_guide.run(whole=self.shown.closed)

        def both(s: Floats) -> Complexes:
            pose = run.circuit.pose(s[:, None])
            with np.errstate(all="ignore"):
                pole = finite_pole(pose.linkages(run.circuit.linkage))["pole"] @ np.array([1, 1j])
                pole = np.where(self.frame.near(pole, 1.0), pole, np.nan)
                away = pole - pose.point(self.shown.home[2:])[:, 0]
                rolling = self.shown.home[2] + (1 + pose.x[:, 0]).conj() * away
            return np.stack([self.frame.at(pole), self.frame.along(rolling - self._origin)], axis=1)

        error = LAYER.centrode_error * self.frame.width
        _, drawn = halved(both, run.samples.at, lambda a, b, inner: off_chord(a, b, inner) / error)
        fixed = element("path", class_="theory", d=polyline(drawn[:, 0]))
        return fixed + self._on_coupler(element("path", class_="theory dashed", d=polyline(drawn[:, 1])))

    def _cubics(self) -> Markup:
        """Return the circling-point curve on the coupler, and the centring-point curve."""
        found = curvature(self._linkage_guide.linkage)
        rho0 = float(found.rho0[0])
        if not np.isfinite(rho0):
            return NOTHING
        axes, pole = found.axes[0] @ np.array([1, 1j]), complex(*found.pole[0])
        reach = 3 * max(self.frame.width, self.frame.height) / self.frame.scale / rho0

        def curve(kappa: float) -> Complexes:
            parts = cubic(kappa * rho0, float(found.s[0]) * rho0, reach)
            gap = np.array([complex(np.nan, np.nan)])
            z = np.concatenate([np.append(part, gap) for part in parts]) if parts else gap
            return self._thin(pole + rho0 * (z.real * axes[0] + z.imag * axes[1]))

        circling = self.frame.along(curve(found.kappa_star[0]) - self._origin)
        centring = element("path", class_="theory", d=polyline(self.frame.at(curve(found.kappa[0])), 1))
        return centring + self._on_coupler(element("path", class_="theory dashed", d=polyline(circling, 1)))

    def _velocity(self) -> Markup:
        """Return the velocity of the guided point at constant drive speed, as a scaled arrow."""
        speed = np.abs(self.shown.velocity)
        seen = np.isfinite(speed)
        if not seen.any() or np.nanmax(speed) == 0:
            return NOTHING
        arrow = (
            self.frame.along(self.shown.velocity)
            / (np.nanmax(speed) * self.frame.scale)
            * LAYER.arrow
            * self.frame.width
        )
        arrow = _fill_invisible(arrow, seen)
        head = 5 * self.frame.point
        size = np.minimum(1, np.abs(arrow) / head)[:, None] * head * np.exp(1j * np.angle(arrow))[:, None]
        barbs = arrow[:, None] - size * np.exp(0.45j * np.array([-1, 1]))
        data = [
            f"M0 0L{pair(a, 1)}M{pair(b, 1)}L{pair(a, 1)} {pair(c, 1)}" for a, (b, c) in zip(arrow, barbs, strict=True)
        ]
        path = element("path", self.clock.animate("d", data), class_="velocity", d=data[self.clock.middle])
        moved = self.clock.moved(self.frame.at(self.shown.guided), "sign", path)
        return element("g", self._visibility_animation(seen), moved, **self._still_opacity(seen))

    def _turn(self) -> Markup:
        """Return the path of the guided point over the whole circuit."""
        if has_bars(self.guide):
            z = chain_poses(self.guide, turn=True).path
        else:
            run = self.guide.run(whole=True)
            z = run.path(run.polyline())
        z = np.where(self.frame.near(z, 0.5), z, np.nan)
        return element("path", class_="faint", d=polyline(self.frame.at(z), 1))

    def _names(self) -> Markup:
        """Return the names of the joints."""
        return svg_names(self.shown.machine, self.frame, self.clock)

    @property
    def _origin(self) -> complex:
        """Coupler point that carries the layer, in the given position."""
        return complex(self.shown.home[self.shown.origin])

    def _linkages(self) -> Linkage:
        """Return the linkages in the poses."""
        kinds = self._linkage_guide.linkage.dyads[0]
        fixed = np.broadcast_to(self.shown.fixed, self.shown.moving.shape)
        z = np.stack([fixed, self.shown.moving], axis=-1)
        w = np.array([[kind != PR, kind != RP] for kind in kinds], float)
        return Linkage.trusted(homogeneous(z, np.broadcast_to(w, z.shape)))

    @cached_property
    def _instants(self) -> tuple[Complexes, Complexes]:
        """Compute pole and diameter of the inflection circle in each pose; NaN where infinite."""
        with np.errstate(all="ignore"):
            found = finite_pole(self._linkages())
            diameter = found["rho0"] * (found["axes"][:, 1] @ np.array([1, 1j]))
            pole = found["pole"] @ np.array([1, 1j])
        finite = np.isfinite(pole) & np.isfinite(diameter)
        return np.where(finite, pole, np.nan), np.where(finite, diameter, np.nan)

    def _still_opacity(self, seen: Mask) -> dict[str, str]:
        """Return the opacity of an element in a still; `seen` marks the poses that show it."""
        return {} if seen.all() else {"opacity": "1" if seen[self.clock.middle] else "0"}

    def _visibility_animation(self, seen: Mask) -> Markup:
        """Return the animation that hides an element in poses outside the mask `seen`."""
        return self.clock.animate("opacity", ["1" if one else "0" for one in seen], calcMode="discrete")

    def _on_coupler(self, *content: str) -> Markup:
        """Draw parts of the coupler in its given position, about its origin."""
        carrier = self.shown.carried(np.array([self._origin]))[:, 0]
        return self.clock.moved(self.frame.at(carrier), "carried", self.clock.turned(self.shown.turn, None, *content))

    def _thin(self, z: Complexes) -> Complexes:
        """Drop points of a curve far off the paper, or very close to the previous one."""
        z = np.where(self.frame.near(z, 1.5), z, np.nan)
        kept, last = [], complex(np.nan)
        step = 3 * self.frame.point / self.frame.scale
        for i, point in enumerate(z):
            broken = np.isnan(point)
            if broken or np.isnan(last) or abs(point - last) >= step or i + 1 == len(z) or np.isnan(z[i + 1]):
                kept.append(point)
                last = point
        return np.array(kept)


def _fill_invisible(z: npt.NDArray[Scalar], seen: Mask) -> npt.NDArray[Scalar]:
    """Replace invisible values by the nearest visible ones."""
    at = np.flatnonzero(seen)
    return np.asarray(z[at[np.abs(np.arange(len(z))[:, None] - at).argmin(1)]])
