"""Sensitivity against 100,000 draws of errors, each linkage moved and traced anew."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, CircularArc, InvalidRequest, StraightLine
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.placement import at_stroke
from catalogue.guidance.sensitivity import displaced, pose_jacobian, sensitivity
from catalogue.guidance.trace import retrace
from catalogue.kinematics.linkage import Linkage

DRAWS, BATCH, ERROR = 20_000, 10_000, 1e-4
WISHES: list[Any] = [
    (StraightLine(150, 0.05), {"families": ["four-bar"]}),
    (StraightLine(150, 0.05), {"families": ["slider-crank"]}),
    (CircularArc(100, 0.05, 100), {"families": ["four-bar"]}),
]


def drawn(c: Candidate) -> float:
    """Return the largest standard deviation of the point's displacement across its path, for errors of 1."""
    guides = c.span()
    path = c.path(9) @ np.array([1, 1j])
    straight = c.radius is None
    centre = 0.0 if straight else 0.5 * c.stroke - 1j * np.sqrt((c.radius or 0) ** 2 - 0.25 * c.stroke**2)
    # places along the nominal at which the moved path is read, and the normals there
    normal = np.full(9, 1j) if straight else (path - centre) / np.abs(path - centre)
    draw, squares, count = np.random.default_rng(7), np.zeros(9), 0
    finite = np.repeat(np.append(guides.linkage.finite[0].reshape(4), True), 2)
    for _ in range(DRAWS // BATCH):
        step = draw.normal(size=(BATCH, 10)) * finite * ERROR * c.stroke
        linkage, point, good = displaced(guides.linkage[np.zeros(BATCH, int)], np.full(BATCH, guides.point[0]), step)
        assert good.all()
        moved = coupler_curve(linkage, point)
        off = np.empty((9, BATCH))
        for k in range(9):
            # the place where the moved path crosses the normal: along the moved tangent to first order, then corrected
            u = ((path[k] - point) * moved.tangent.conj()).real
            for _ in range(4):
                t, _ = moved.window(u, u)
                x, y = moved.path(t[None])
                z = point + (x[0] + 1j * y[0]) * moved.tangent
                along = ((path[k] - z) * (-1j * normal[k]).conjugate()).real
                u = u + along * np.sign((moved.tangent * (-1j * normal[k]).conjugate()).real)
            off[k] = ((z - path[k]) * normal[k].conjugate()).real
        squares += np.nansum(off**2, axis=1)
        count += BATCH
    return float(np.sqrt(squares / count).max() / (ERROR * c.stroke))


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "wish"), WISHES, ids=["line", "slider", "arc"])
def test_spread_is_that_of_draws(small: Catalogue, request_: Any, wish: dict[str, Any]) -> None:
    c = small.find(request_, limit=1, min_transmission=40, **wish)[0]
    assert c.sensitivity().rms[0] == pytest.approx(drawn(c), rel=0.02)


@pytest.mark.slow
def test_worst_and_spread_bound_one_another(small: Catalogue) -> None:
    c = small.find(StraightLine(150, 0.05), families=["four-bar"], limit=1)[0]
    s = c.sensitivity()
    assert s.pivots.shape == (1, 2, 2)
    assert s.pivots.max() <= s.worst[0] <= s.pivots.sum() + s.point[0] + 1e-12
    assert s.rms[0] <= s.worst[0] <= np.sqrt(5) * s.rms[0] + 1e-12
    assert s.point[0] >= 1 - 1e-9  # the point is carried with the coupler, wherever that is


@pytest.mark.slow
def test_a_returning_point_has_none(small: Catalogue) -> None:
    c = small.find(StraightLine(150, 0.05), families=["elliptic-trammel"], limit=1)[0]
    resting = replace(c, guided=[float(v) for v in _pole(c)])
    with pytest.raises(InvalidRequest, match="returns: its sensitivity is not known"):
        resting.sensitivity()


def _pole(c: Candidate) -> Any:
    from catalogue import curvature

    return curvature(c.linkage).pole[0]


@pytest.mark.parametrize("sweep", [0.5, 1.5, 2.6])
def test_across_an_exact_arc_is_along_its_radius(sweep: float) -> None:
    """Of a parallelogram, whose points all run on circles of the cranks' radius."""
    radius, point = 2.0, 0.3 + 2.7j
    linkage = Linkage(np.array([[[0, 0, 1], [0, radius, 1]], [[1.5, 0, 1], [1.5, radius, 1]]]))
    guides = coupler_curve(linkage, np.array([point]), pole=np.array([complex(np.nan, np.nan)]))
    traced = at_stroke(guides, 2 * radius * np.sin(0.5 * sweep), circle=True)
    found = sensitivity(guides, traced, 256)
    t = traced.low + (traced.high - traced.low) * np.linspace(0, 1, 801)[:, None]
    off = guides.motion.pose(t).point(guides.point) - (point - 1j * radius)
    np.testing.assert_allclose(np.abs(off), radius, rtol=1e-12)
    by = pose_jacobian(guides.motion, guides.point, t, 1j * off / radius).across.reshape(801, 5, 2)
    each = np.sqrt((by**2).sum(2))
    np.testing.assert_allclose(found.pivots[0].ravel(), each[:, :4].max(0), rtol=1e-3)
    assert found.point[0] == pytest.approx(1, rel=1e-9)
    assert found.worst[0] == pytest.approx(each.sum(1).max(), rel=1e-3)
    assert found.rms[0] == pytest.approx(np.sqrt((each**2).sum(1)).max(), rel=1e-3)


def test_a_narrow_peak_is_not_passed_over() -> None:
    """An inverted slider-crank whose fixed pivot comes within 2.5e-6 of the guided line near the end of the stroke,
    about which the point follows errors many times as far as elsewhere."""
    linkage = Linkage(
        [[[0.48907165387008733, -0.3281902205529979, 1.0], [-0.1976986682316739, 0.9802628405582977, 0.0]],
         [[1.7597421025131916, -0.38466033576106945, 1.0], [0.16257570308577207, -0.3940402268190428, 1.0]]]
    )  # fmt: skip
    guides = coupler_curve(linkage, np.array([0.5000000000000002 + 0.27425252715492304j]))
    traced = at_stroke(guides, 1.0, circle=True, extend=False)
    held = retrace(guides, traced, circle=True, nodes=32, held=np.where(guides.tangent.real > 0, -1, 1) / 0.6)
    coarse, as_needed = (sensitivity(guides, held, *stations).rms[0] for stations in [(32, 32), ()])
    assert coarse < 200
    assert as_needed > 500  # 536 at 1,201 even places along the path; none that is read is the highest


@pytest.mark.slow
@pytest.mark.parametrize("family", ["four-bar", "inverted-slider-crank"])
def test_of_an_answer_along_an_arc_of_given_radius_it_is_across_that_arc(small: Catalogue, family: str) -> None:
    found = small.find(CircularArc(1, 0.01, 0.6), families=[family], max_size=3, limit=3)
    assert len(found)
    for c in found:
        assert c.sensitivity().rms[0] == pytest.approx(c.sensitivity_rms, rel=1e-4)
