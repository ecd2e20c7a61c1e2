"""Mechanisms of joints against the golden numbers of guided bodies, and Jacobians of every element by differences."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.spatial import (
    Angle,
    Cylindrical,
    GuideCoordinate,
    Joint,
    KeepAngle,
    Length,
    Link,
    Mechanism,
    OnGuide,
    Prismatic,
    Revolute,
    Spherical,
    Travel,
    in_time,
)


@pytest.mark.slow
def test_golden_cases_are_met_with_derivatives(golden_cases: list[SimpleNamespace], tools: SimpleNamespace) -> None:
    """Every golden case with one freedom, its design pose being the golden one, driven by the coordinate on a guide."""
    met = 0
    for golden in golden_cases:
        case, drivers = golden.case, golden.case["drivers"]
        if len(drivers) > 1:
            continue
        points = tools.numbers(case["solution"]["points"])
        names = [f"guide {i}" for i in range(len(points))]
        elements = []
        for name, guide, x in zip(names, case["guides"], points[:, 0], strict=True):
            kind = tools.kind_name(guide)
            shape = [float(v) for v in guide["params"].values()]
            origin, quat = tools.numbers(guide["origin"]), tools.numbers(guide["quat"])
            elements.append(OnGuide("body", x, kind, shape, origin, quat, name=name))
        drive = GuideCoordinate(names[drivers[0]["point"] - 1], drivers[0]["coordinate"])
        motion = Mechanism(elements).sweep(drive, [float(drivers[0]["q"][0])])
        assert motion.success.all(), case["id"]
        rates = tools.numbers(drivers[0]["q"])[1:]
        for i in range(len(points)):
            got = in_time(motion.point("body", points[i, 0], 3)[0].T, rates).T
            # the rounding of the golden pose is magnified by the condition number
            loss = 1e-13 * float(golden.at.condition[0])
            assert np.abs(got[0] - points[i, 0]).max() < 1e-12, case["id"]
            for k in (1, 2, 3):
                scale = max(np.abs(points[:, k]).max(), 1)
                assert np.abs(got[k] - points[i, k]).max() / scale < max(1e-11, loss), (case["id"], k)
        met += 1
    assert met == 13


EVERYTHING: list[Any] = [
    Revolute("a", (0, 0, 0), axis=(0, 0.1, 1)),
    Prismatic("b", (1, 0.2, 0), on="a"),
    Cylindrical("c", (2, 0, 0.3), axis=(0.1, 1, 0.2), on="b"),
    Revolute("c", (2, 0.5, 0.3), axis=(1, 1, 0.2), on="d", name="closing R"),
    Prismatic("e", (0, 0, 1)),
    Prismatic("e", (0, 1, 1), on="d", name="closing P"),
    Cylindrical("e", (1, 1, 1), axis=(0, 1, 3), on="a", name="closing C"),
    Spherical("d", (3, 1, 0), on="e"),
    Link("a", (0.3, 0.4, 0.5), "d", (2, 2, 1)),
    KeepAngle("c", (1, 0, 0.2), "f", (0, 1, 0.1)),
    OnGuide("f", (1.5, 0, 0), "torus", (1.0, 0.5), on="c"),
    OnGuide("f", (0.0, 1.0, 0.4), "circle", (1.0,), (0, 0, 0.4), name="ring"),
    OnGuide("d", (2.0, 0.1, 0.4), "plane", (), (0, 0, 0.4), on="f", name="table"),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    "scalar",
    [
        Joint("b"),
        Joint("c", 1),
        Travel("d", (1, 2, 3), (1, 2, 2)),
        Length("a", (1, 0, 0), "f", (0, 0, 2)),
        Angle("d", (1, 0.2, 0), (0, 0.3, 1)),
        GuideCoordinate("ring", "u"),
        GuideCoordinate("table", "w"),
    ],
    ids=lambda s: type(s).__name__,
)
def test_screws_and_wrenches_are_the_derivatives(scalar: Any) -> None:
    """Of residuals and scalars by every unknown, in a pose that is not the design pose, all elements together."""
    from catalogue.spatial.jointed.formulation import Formulation

    system = Formulation(EVERYTHING, [scalar]).system()
    draw = np.random.default_rng(1)
    y = system.moved(system.design[None], draw.uniform(-0.4, 0.4, (1, system.unknowns)))
    _, _, jacobian = system.evaluate(y)
    h = 1e-6
    for k in range(system.unknowns):
        step = np.zeros((1, system.unknowns))
        step[0, k] = h
        (r, v, _), (s, w, _) = system.evaluate(system.moved(y, step)), system.evaluate(system.moved(y, -step))
        by = np.concatenate([r - s, v - w], axis=1)[0] / (2 * h)
        guides = [row for g in system.guides for row in range(g.rows.start, g.rows.stop)]
        exact = [i for i in range(len(by)) if i not in guides]
        assert np.abs(by - jacobian[0, :, k])[exact].max() < 1e-8
    # off a guide its function over its slope is the distance to first order only: compared where it vanishes
    y = system.design[None]
    _, _, jacobian = system.evaluate(y)
    for k in range(system.unknowns):
        step = np.zeros((1, system.unknowns))
        step[0, k] = h
        r, s = system.evaluate(system.moved(y, step))[0], system.evaluate(system.moved(y, -step))[0]
        assert np.abs((r - s)[0] / (2 * h) - jacobian[0, : system.rows, k]).max() < 1e-8
    # the series of first order are the same derivatives
    x = np.zeros((2, 1, system.unknowns))
    x[1] = draw.normal(size=(1, system.unknowns))
    rotation, shift = system.poses(y, x)
    series = system.residual(*system.attached(rotation, shift), rotation, shift)
    assert np.abs(series[1, 0] - jacobian[0, : system.rows] @ x[1, 0]).max() < 1e-12
