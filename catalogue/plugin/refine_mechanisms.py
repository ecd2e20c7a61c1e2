"""Refinement of mechanisms of many bars: least squares on the finite motion.

The path is sampled at fixed positions of the drive. Its distances from the best line or circle,
over the chord, are the residuals. Their derivatives by the joints are those of `chains.rates`; the
joints are functions of the free parameters of the family, so that its relations hold. The weights
of large residuals grow from round to round, so that least squares approaches the least maximum.

Source: K. Levenberg 1944, D. Marquardt 1963; E. Ya. Remez on the weight of extremes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..chains.chain import Chain
from ..chains.circuits import followed_circuits
from ..chains.poses import poses
from ..chains.rates import slopes
from ..kinematics.types import Array, Complexes, Floats, Mask
from ..series.chain_family import ChainFamily


@dataclass(frozen=True)
class RefineOptions:
    """Options of the refinement of mechanisms.

    Attributes
    ----------
    nodes : int
        Number of positions of the path.
    rounds : int
        Largest number of steps.
    step : float
        Relative step of finite differences by the parameters.
    damping : float
        Damping of the first step, over the largest diagonal element.
    """

    nodes: int = 33
    rounds: int = 30
    step: float = 1e-6
    damping: float = 1e-3


REFINE = RefineOptions()


@dataclass(frozen=True)
class Refined:
    """Refined mechanisms (n,): parameters, drive at both ends (2, n), and which have moved."""

    values: dict[str, Floats]
    window: Floats
    moved: Mask


def refined(family: ChainFamily, values: dict[str, Floats], windows: Floats, circle: bool) -> Refined | None:
    """Reduce the deviations of mechanisms over their windows.

    Parameters
    ----------
    family : ChainFamily
    values : dict of str to ndarray, shape (n,)
        Parameters.
    windows : ndarray, shape (2, n)
        Phases of the ends of their paths [rad].
    circle : bool
        Whether paths follow circles rather than lines.

    Returns
    -------
    Refined or None
        None if a mechanism cannot be closed.
    """
    chain, valid = family.chains(values)
    found, kept = followed_circuits(chain, family.bar)
    if not valid.all() or len(kept) < len(valid):
        return None
    drive = np.stack([found.drive(end[None])[0][0] for end in windows])
    back = found.phase_of(drive[0]), found.phase_of(drive[1])
    one_leg = np.all(
        [np.abs(np.mod(a - b + 1, found.period) - 1) < 1e-6 for a, b in zip(back, windows, strict=True)], 0
    )
    problem = _Problem(family, drive, circle)
    names = list(values)
    x = np.stack([values[name] for name in names])
    low, high = problem.domain(x, names)
    off, slope = problem.residuals(x, names)
    largest, damping = np.abs(off).max(0), np.full(x.shape[1], REFINE.damping)
    first = largest.copy()
    for turn in range(REFINE.rounds):
        # weights of residuals near the largest grow with the rounds
        weight = (np.abs(off) / largest) ** min(turn // 3, 4)
        a, b = weight[:, None] * slope, weight * off
        normal = np.einsum("mpn,mqn->npq", a, a)
        diagonal = np.einsum("npp->np", normal)
        lift = damping[:, None] * diagonal.max(1, keepdims=True) + 1e-30
        normal = normal + lift[..., None] * np.eye(len(names))
        step = -np.linalg.solve(normal, np.einsum("mpn,mn->np", a, b)[..., None])[..., 0].T
        trial = np.clip(x + step, low, high)
        new, new_slope = problem.residuals(trial, names)
        size = np.where(np.isfinite(new).all(0), np.abs(new).max(0), np.inf)
        better = (size < largest) & one_leg
        x = np.where(better, trial, x)
        off, slope = np.where(better, new, off), np.where(better, new_slope, slope)
        largest, damping = np.where(better, size, largest), np.where(better, 0.3 * damping, 8 * damping)
    return Refined(dict(zip(names, x, strict=True)), drive, largest < 0.99 * first)


@dataclass(frozen=True)
class _Problem:
    """Residuals of n mechanisms of a family over ranges of their drives."""

    family: ChainFamily
    drive: Floats
    circle: bool

    def domain(self, x: Floats, names: list[str]) -> tuple[Floats, Floats]:
        """Return the ends of the intervals that contain the parameters (p, n)."""
        low, high = np.full(x.shape, -np.inf), np.full(x.shape, np.inf)
        for row, name in enumerate(names):
            (parameter,) = (one for one in self.family.parameters if one.name == name)
            for a, b in parameter.domain:
                inside = (x[row] >= a) & (x[row] <= b)
                low[row], high[row] = np.where(inside, a, low[row]), np.where(inside, b, high[row])
        return low, high

    def residuals(self, x: Floats, names: list[str]) -> tuple[Floats, Floats]:
        """Return distances from the nominal over the chord (m, n), and derivatives (m, p, n)."""
        n = x.shape[1]
        nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(REFINE.nodes) / (REFINE.nodes - 1))
        off, slope = np.full((len(nodes), n), np.nan), np.full((len(nodes), len(names), n), np.nan)
        chain, valid = self.family.chains(dict(zip(names, x, strict=True)))
        some = np.flatnonzero(valid)
        if not len(some):
            return off, slope
        drive = self.drive[0, some] + (self.drive[1] - self.drive[0])[some] * nodes[:, None]
        with np.errstate(all="ignore"):
            at = poses(chain, drive, chain.branch)
            z, dz = at.joint(self.family.guided), slopes(at).of_joint(self.family.guided)
            by_joints = self._joint_slopes(x[:, some], names, chain)
            dp = np.einsum("kmn,kpn->mpn", dz, by_joints)
            off[:, some], slope[:, :, some] = _from_nominal(z, dp, self.circle)
        return off, slope

    def _joint_slopes(self, x: Floats, names: list[str], chain: Chain) -> Floats:
        """Return the derivatives of the reference pose by parameters, (k, p, n)."""
        found = []
        for row in range(len(names)):
            step = REFINE.step * np.maximum(np.abs(x[row]), 0.1)
            ends = []
            for side in (1, -1):
                moved = x.copy()
                moved[row] += side * step
                z, u = self.family.placed(dict(zip(names, moved, strict=True)))
                turned = np.angle(u / chain.u)
                ends.append(np.concatenate([np.stack([z.real, z.imag], 1).reshape(-1, z.shape[1]), turned]))
            found.append((ends[0] - ends[1]) / (2 * step))
        return np.stack(found, 1)


def _from_nominal(z: Complexes, dz: Array, circle: bool) -> tuple[Floats, Floats]:
    """Compute distances of points (m, n) from the least-squares line or parabola over the chord.

    For short arcs the parabola replaces a circle, with an error of the square of the distances. The
    derivatives are at a fixed nominal: moves of the best-fitting nominal have no first-order
    effect.
    """
    closed = np.isfinite(z).all(0) & np.isfinite(dz).all((0, 1)) & (z[0] != z[-1])
    chord = np.where(closed, z[-1] - z[0], 1)
    local, moved = np.where(closed, (z - z[0]) / chord, 0), np.where(closed, dz / chord, 0)
    d_start, d_chord = moved[0], moved[-1] - moved[0]
    turned = moved - d_start - local[:, None] * d_chord
    t = local.real
    basis = np.stack([np.ones_like(t), t, t * t] if circle else [np.ones_like(t), t], -1)  # (m, n, c)
    pinv = np.linalg.pinv(np.moveaxis(basis, 0, 1))  # (n, c, m)
    fit = np.einsum("ncm,mn->nc", pinv, local.imag)
    off = local.imag - np.einsum("mnc,nc->mn", basis, fit)
    # a point that moves along the nominal changes its height by the nominal's slope
    rise = fit[:, 1] + (2 * fit[:, 2] * t if circle else 0 * t)
    slope = turned.imag - rise[:, None] * turned.real
    slope = slope - np.einsum("mnc,npc->mpn", basis, np.einsum("ncm,mpn->npc", pinv, slope))
    return np.where(closed, off, np.nan), slope
