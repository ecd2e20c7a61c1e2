"""The equations of the two notes against ours: distances of curvilinear points, and Euler angles (Nota I)."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.errors import InvalidLinkage

Cases = list[SimpleNamespace]


def undriven(c: SimpleNamespace) -> list[tuple[int, int]]:
    """Return the free coordinates (point, axis)."""
    every = [(i, a) for i in range(len(c.mechanism.curves)) for a in ((0,) if c.mechanism.curves[i] else (0, 1))]
    return [(i, a) for i, a in every if (i, "uw"[a]) not in c.mechanism.drivers]


def placed(spatial: SimpleNamespace, m: Any, coordinates: Any) -> tuple[Any, Any]:
    """Return points (p, 3) and tangents (p, 2, 3) of one mechanism in the world."""
    x, t = [], []
    for g, (u, w) in zip(m.guides, coordinates, strict=True):
        ((kind, _, p),) = g.each()
        local, along = kind.tangents(np.array([u]), np.array([0.0 if np.isnan(w) else w]), p)
        frame = spatial.matrix(g.quaternion.T)[..., 0]
        x.append(g.origin[0] + frame @ local[:, 0])
        t.append((frame @ along[..., 0].T).T)
    return np.array(x), np.array(t)


def distances(spatial: SimpleNamespace, c: SimpleNamespace, pairs: Any, start: Any, steps: int = 25) -> Any:
    """Solve the curvilinear distance equations of the pairs by plain Newton; return coordinates, Jacobian, residual."""
    free, m = undriven(c), c.mechanism
    coordinates = np.array(start, float)
    coordinates[[i for i, _ in m.drivers], ["uw".index(k) for _, k in m.drivers]] = c.q[:, 0]
    unit = m.diameter[0]
    for _ in range(steps):
        x, t = placed(spatial, m, coordinates)
        residual, jacobian = [], []
        for j, k in pairs:
            e = (x[j] - x[k]) / unit
            residual.append(e @ e - ((m.body[0, j] - m.body[0, k]) ** 2).sum() / unit**2)
            sign = {j: 2.0, k: -2.0}
            jacobian.append([sign.get(i, 0.0) * (e @ t[i, a]) / unit for i, a in free])
        step, *_ = np.linalg.lstsq(np.array(jacobian), -np.array(residual), rcond=None)
        for (i, a), d in zip(free, step, strict=True):
            coordinates[i, a] += d
    return coordinates, np.array(jacobian), np.abs(residual).max()


def start_of(c: SimpleNamespace) -> Any:
    """Return rough coordinates in the charts of the case."""
    return np.stack([[np.nan if v is None else float(v) for v in c.case["start"][k]] for k in "uw"], axis=1)


@pytest.mark.slow
def test_all_distances_give_our_positions(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """(2.2a.3), (2.2b.2), (2.2c.2), (3.3a.2), (3.3b.1), (4.4a.2); the flat body has only its square root of digits."""
    for c in golden_cases:
        pairs = list(combinations(range(len(c.mechanism.curves)), 2))
        coordinates, jacobian, _ = distances(spatial, c, pairs, start_of(c))
        x, _ = placed(spatial, c.mechanism, coordinates)
        error = np.abs(x - c.at.points[0]).max() / c.mechanism.diameter[0]
        if c.id == "II-coplanar-body":
            assert 1e-10 < error < 1e-6
            assert np.linalg.cond(jacobian) > 1e7 > 1e3 > c.at.condition[0]
        else:
            assert error < 1e-12, c.id


def test_which_nine_of_the_ten_distances(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """Each choice's determinant is in proportion to the self-stress of the pair that is left out."""
    for c in golden_cases:
        if c.mechanism.name == "I":
            pairs = list(combinations(range(5), 2))
            _, jacobian, _ = distances(spatial, c, pairs, start_of(c))
            b = np.c_[c.mechanism.body[0], np.ones(5)]
            stress = np.array([(-1) ** i * np.linalg.det(np.delete(b, i, 0)) for i in range(5)])
            ratio = [
                abs(np.linalg.det(np.delete(jacobian, r, 0)) / (stress[j] * stress[k]))
                for r, (j, k) in enumerate(pairs)
            ]
            np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


@pytest.mark.slow
def test_distances_admit_bodies_that_ours_know_to_be_wrong(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """Mirror images pass all ten distances; assemblies of nine may violate the tenth.  Ours gives neither."""
    (c,) = [c for c in golden_cases if c.id == "I-five-spheres"]
    pairs = list(combinations(range(5), 2))
    draw = np.random.default_rng(3)
    handed = np.sign(np.linalg.det(c.mechanism.body[0, 1:4] - c.mechanism.body[0, 0]))
    body = np.linalg.norm(c.mechanism.body[0][:, None] - c.mechanism.body[0], axis=-1)
    found = {"mirror": 0, "violated": 0}
    for _ in range(400):
        if all(found.values()):
            break
        start = draw.uniform(-np.pi, np.pi, (5, 2))
        for used in (pairs, [pair for pair in pairs if pair != (1, 4)]):
            with np.errstate(all="ignore"):
                coordinates, _, residual = distances(spatial, c, used, start, 40)
            if residual < 1e-12:
                x, _ = placed(spatial, c.mechanism, coordinates)
                apart = np.abs(np.linalg.norm(x[:, None] - x, axis=-1) - body).max()
                found["violated"] += apart > 1e-6
                found["mirror"] += apart < 1e-6 and np.sign(np.linalg.det(x[1:4] - x[0])) != handed
    assert all(found.values())
    ours = spatial.assemblies(c.mechanism, c.q[:, 0]).positions.points
    assert (np.sign(np.linalg.det(ours[:, 1:4] - ours[:, :1])) == handed).all()
    assert np.abs(np.linalg.norm(ours[:, :, None] - ours[:, None], axis=-1) - body).max() < 1e-12


def euler(psi: float, theta: float, phi: float) -> Any:
    """Return Rz(psi) Rx(theta) Rz(phi)."""

    def about(axis: int, a: float) -> Any:
        i, j = [k for k in range(3) if k != axis]
        r = np.eye(3)
        r[i, i] = r[j, j] = np.cos(a)
        r[i, j], r[j, i] = -np.sin(a), np.sin(a)
        return r

    return about(2, psi) @ about(0, theta) @ about(2, phi)


def test_euler_angles_of_the_first_note_give_our_positions(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    """Theorems 1 and 2 with the corrected Jacobian, columns in the order of the unknowns (psi, theta, phi)."""
    met = 0
    for c in golden_cases:
        m = c.mechanism
        angles = c.case["solution"]["euler_zxz"]
        if m.name not in ("II", "III") or m.drivers[0][0] != 0 or angles["singular"]:
            continue
        met += 1
        x1, arms = c.at.points[0, 0], m.body[0] - m.body[0, 0]
        a = np.array([float(angles[k]) for k in ("psi", "theta", "phi")]) + 0.01
        for _ in range(12):
            r = euler(*a)
            about = np.array([[0, 0, 1], [np.cos(a[0]), np.sin(a[0]), 0],
                              [np.sin(a[0]) * np.sin(a[1]), -np.cos(a[0]) * np.sin(a[1]), np.cos(a[1])]])  # fmt: skip
            f, w = [], []
            for g, arm in zip(m.guides[1:], arms[1:], strict=True):
                ((kind, _, p),) = g.each()
                frame = spatial.matrix(g.quaternion.T)[..., 0]
                values, normals = kind.gradients((frame.T @ (x1 + r @ arm - g.origin[0]))[:, None], p)
                for value, normal in zip(values[:, 0], normals[..., 0], strict=True):
                    f.append(value)
                    w.append(about @ np.cross(r @ arm, frame @ normal))
            a = a - np.linalg.solve(np.array(w), np.array(f))
        assert np.abs(x1 + arms @ euler(*a).T - c.at.points[0]).max() < 1e-12 * m.diameter[0], c.id
    assert met == 8


@pytest.mark.parametrize("h", [0.3, 1e-3, 1e-6, 0.0])
def test_a_flat_body_is_like_any_other(spatial: SimpleNamespace, golden_cases: Cases, h: float) -> None:
    (c,) = [c for c in golden_cases if c.id == "II-coplanar-body"]
    body = c.mechanism.body[0].copy()
    body[3, 1] = h
    m = spatial.Mechanisms(body, c.mechanism.guides, c.mechanism.drivers)
    at = spatial.solve_positions(m, c.q[:, 0], c.at)
    assert at.success[0]
    assert at.condition[0] < 20
    assert spatial.jets(m, at, c.q[:, 1:]).condition[0] < 20


def test_a_collinear_body_is_refused(spatial: SimpleNamespace, golden_cases: Cases) -> None:
    c = golden_cases[0]
    with pytest.raises(InvalidLinkage, match="on one line"):
        spatial.Mechanisms([[0, 0, 0], [1, 2, 3], [2, 4, 6]], c.mechanism.guides, c.mechanism.drivers)
