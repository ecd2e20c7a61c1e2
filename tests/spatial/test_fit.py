"""Hard points fitted to curves: known ones are found again, optima are those of closed equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from catalogue.errors import InvalidRequest, NotMovable
from catalogue.spatial import (
    Bound,
    Box,
    Joint,
    Link,
    Mechanism,
    Motion,
    OnGuide,
    Revolute,
    Spherical,
    Sweep,
    Target,
    Travel,
    Wheel,
    fit,
    kinematics,
    link_length,
    off_circle,
    off_line,
    transmission,
)
from catalogue.spatial.fitting.boxes import Variables
from catalogue.spatial.fitting.trials import Stacked, Trials

NAMES = ("upper rear", "upper front", "lower rear", "lower front", "tie rod")
INNER = np.array([[-120, 450, 230], [130, 440, 240], [-150, 400, -60], [140, 390, -70], [90, 420, -10.0]])
OUTER = np.array([[-10, 690, 210], [15, 695, 215], [-20, 720, -90], [25, 715, -95], [110, 700, -5.0]])
WHEEL = Wheel("wheel", (0, 760.0, 0), (0.01, 1, -0.02), 310.0)
BUMP = Sweep(Travel("wheel", WHEEL.centre), np.linspace(-80, 80, 9))


def axle(inner: Any = INNER, outer: Any = OUTER) -> Mechanism:
    return Mechanism([Link("ground", a, "wheel", b, n) for n, a, b in zip(NAMES, inner, outer, strict=True)])


def column(name: str) -> Callable[[Motion], Any]:
    return lambda motion: kinematics(motion, WHEEL)[name]


def reads(mechanism: Mechanism, name: str, over: Sweep = BUMP) -> Any:
    return column(name)(mechanism.sweep(over.drive, over.values)).to_numpy()


def targets(mechanism: Mechanism, *names: str, tolerance: float = 1e-9) -> list[Target]:
    return [Target(n, column(n), BUMP, reads(mechanism, n), tolerance) for n in names]


@pytest.mark.slow
def test_hard_points_of_a_perturbed_axle_are_found_again() -> None:
    outer = OUTER.copy()
    outer[4] += (3.0, -2.0, 4.0)
    outer[0, 1:] += (-3.0, 2.5)
    found = fit(
        axle(outer=outer),
        targets(axle(), "toe [deg]", "camber [deg]", "recession [mm]"),
        [Box("tie rod.to", 8), Box("upper rear.to", (0, 8, 8))],
    )
    assert found.success
    assert (found.targets["largest after"] < 1e-9).all()
    assert (found.targets["largest before"] > 1e-3).all()
    np.testing.assert_allclose(found.displacements["tie rod.to"], (-3, 2, -4), atol=1e-5)
    np.testing.assert_allclose(found.displacements["upper rear.to"], (0, 3, -2.5), atol=1e-5)
    for name in ("toe [deg]", "camber [deg]"):  # of the mechanism that is given back, swept anew
        assert np.abs(reads(found.mechanism, name) - reads(axle(), name)).max() < 1e-9
    assert not found.missed
    assert len(found.held_back) == 0


@pytest.mark.slow
@pytest.mark.parametrize("offset", [False, True])
def test_gradients_are_those_of_mechanisms_swept_anew(offset: bool) -> None:
    rng = np.random.default_rng(5)
    sweeps = [BUMP, Sweep(Travel("wheel", (0, 760, 100), (0.1, 0, 1)), np.linspace(-30, 50, 4))]
    curves = [
        Target("toe", column("toe [deg]"), sweeps[0]),
        Target("point", lambda m: m.point("wheel", (10, 700, 50)), sweeps[1], offset=offset),
        Target("length", lambda m: link_length(m, "tie rod"), sweeps[0]),
        Target("relative toe", lambda m: column("toe [deg]")(m) - column("toe [deg]")(m)[0], sweeps[0]),
    ]
    boxes = [Box("tie rod.to", (5, 0, 8)), Box(["lower rear.from", "lower front.from"], (4, 3, 0), mirror="x")]
    variables = Variables(axle(), boxes)
    trials = Trials(variables, curves)
    u = rng.uniform(-0.5, 0.5, len(variables.half))
    trial = trials.at(u)
    assert trial is not None
    h = 1e-4
    for k, step in enumerate(np.eye(len(u)) * h):
        ahead, behind = trials.at(u + step), trials.at(u - step)
        assert ahead is not None
        assert behind is not None
        for got, one, other in zip(trials.gradient(trial), ahead.read, behind.read, strict=True):
            np.testing.assert_allclose(got[..., k], (one - other) / (2 * h), atol=2e-7)
    assert list(trials.pointwise.values()) == [True, True, True, False]


def test_a_gradient_does_not_depend_on_how_wide_a_box_is() -> None:
    """Mechanisms are displaced by the same way for it."""
    curves = [Target("toe", column("toe [deg]"), BUMP)]
    slopes = []
    for wide in (0.5, 200.0):
        trials = Trials(Variables(axle(), [Box("tie rod.to", wide)]), curves)
        trial = trials.at(np.zeros(3))
        assert trial is not None
        slopes.append(trials.gradient(trial)[0] / wide)
    np.testing.assert_allclose(slopes[1], slopes[0], atol=1e-6 * np.abs(slopes[0]).max())


def rssr(crank: Any = (10, 0, 0), rocker: Any = (40, 5, 40), at: Any = (40, 0, 10)) -> Mechanism:
    return Mechanism(
        [
            Revolute("crank", (0, 0, 0), axis=(0, 0, 1)),
            Revolute("rocker", at, axis=(0, 1, 0)),
            Link("crank", crank, "rocker", rocker, "rod"),
        ]
    )


def closed(crank: Any, rocker: Any, at: Any, q: Any) -> Any:
    """The rocker's angle from the distance of the ends of the rod: A cos + B sin = C, on the branch through 0."""
    a, b, c = (np.asarray(v, float) for v in (crank, rocker, at))
    e = b - c  # turned about y by w: (x cos w + z sin w, y, z cos w - x sin w)
    tip = np.stack([a[0] * np.cos(q) - a[1] * np.sin(q), a[0] * np.sin(q) + a[1] * np.cos(q), a[2] + 0 * q], axis=1)
    p = tip - c
    length = ((b - a) ** 2).sum()
    one, other = p[:, 0] * e[0] + p[:, 2] * e[2], p[:, 0] * e[2] - p[:, 2] * e[0]
    right = ((p**2).sum(1) + e @ e - length) / 2 - p[:, 1] * e[1]
    middle, half = np.arctan2(other, one), np.arccos(right / np.hypot(one, other))
    both = np.stack([middle + half, middle - half])
    both = np.remainder(both + np.pi, 2 * np.pi) - np.pi
    branch = np.abs(both[:, np.abs(q).argmin()]).argmin()
    return both[branch]


@pytest.mark.slow
def test_a_function_generator_is_the_optimum_of_its_closed_equation() -> None:
    q = np.radians(np.linspace(-40, 40, 17))
    wanted = np.degrees(0.25 * np.sin(q) - 0.1 * q**2)
    half = np.array([4, 4, 4, 6.0])

    def off(u: Any) -> Any:
        d = u * half
        crank, rocker = np.array([10 + d[0], d[1], 0.0]), np.array([40, 5 + d[2], 40 + d[3]])
        got = np.degrees(closed(crank, rocker, (40, 0, 10), q)) - wanted
        return (got - got.mean()) / np.sqrt(len(q))

    rival = least_squares(off, np.zeros(4), bounds=(-1, 1), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    target = Target(
        "rocker",
        lambda m: np.degrees(m.joint("rocker")),
        Sweep(Joint("crank"), q),
        wanted,
        0.01,
        offset=True,
        unit="deg",
    )
    found = fit(rssr(), [target], [Box("rod.from", (4, 4, 0)), Box("rod.to", (0, 4, 6))])
    assert found.targets["rms after"][0] == pytest.approx(np.sqrt(2 * rival.cost), rel=1e-5)
    assert found.targets["rms before"][0] == pytest.approx(np.sqrt((off(np.zeros(4)) ** 2).sum()), rel=1e-9)
    assert not found.success
    assert "rocker is missed by" in found.missed[0]


def test_displacements_are_told_by_coordinate_and_as_a_whole() -> None:
    """A rod of |(30, 5, 40)| is made longer by its end, as far as it may go along each axis."""
    over = Sweep(Joint("crank"), np.radians([-10.0, 0.0, 10.0]))
    target = Target("length", lambda m: link_length(m, "rod"), over, 53.0, tolerance=0.5)
    found = fit(rssr(), [target], [Box("rod.to", (1, 2, 3))], starts=1)
    [row] = found.points.to_numpy()
    moved = found.displacements["rod.to"]
    assert (np.abs(moved) > 0.01).all()
    assert row[0] == "rod.to"
    np.testing.assert_allclose(row[1:4].astype(float), moved, rtol=1e-12)
    assert row[4] == pytest.approx(np.linalg.norm(moved), rel=1e-12)


def test_a_batch_is_not_fitted() -> None:
    """Though one of its two hard points is the same for all."""
    many = Mechanism(
        [Revolute("a", (0, 0, 0), axis=(0, 0, 1)), Link("a", [(1, 0, 0), (2, 0, 0)], "b", (4, 0, 0)),
         Revolute("b", (4, 1, 0), axis=(0, 0, 1))]
    )  # fmt: skip
    target = Target("angle", lambda m: m.joint("b"), Sweep(Joint("a"), [0.0, 0.1]), 0.0, tolerance=0.5)
    with pytest.raises(InvalidRequest, match="of one mechanism, not of a batch"):
        fit(many, [target], [Box("link 1.to", 1)])


@pytest.mark.slow
def test_an_active_box_is_named_with_what_it_costs() -> None:
    outer = OUTER.copy()
    outer[4, 2] += 6.0
    given = axle(outer=outer)
    found = fit(given, targets(axle(), "toe [deg]", tolerance=0.001), [Box("tie rod.to", (0, 0, 2))])
    assert found.displacements["tie rod.to"] == pytest.approx((0, 0, -2), abs=1e-9)
    assert list(found.held_back["coordinate"]) == ["tie rod.to z"]
    h = 1e-3
    squares = []
    for z in (2 - h, 2 + h):
        moved = outer.copy()
        moved[4, 2] -= z
        off = (reads(axle(outer=moved), "toe [deg]") - reads(axle(), "toe [deg]")) / 0.001
        squares.append((off**2).mean())
    assert found.held_back["gain [1/mm]"][0] == pytest.approx((squares[0] - squares[1]) / (2 * h), rel=1e-5)


@pytest.mark.parametrize("wanted", [52.0, 50.8])
def test_a_rod_that_is_to_be_longer_than_its_box_allows_is_held_back(wanted: float) -> None:
    """Its end may be raised by 1, which makes it sqrt(925 + 41^2) long."""
    over = Sweep(Joint("crank"), np.radians([-10.0, 0.0, 10.0]))
    target = Target("length", lambda m: link_length(m, "rod"), over, wanted, tolerance=0.5)
    found = fit(rssr(), [target], [Box("rod.to", (0, 0, 1))], starts=1)
    height = min(np.sqrt(wanted**2 - 925), 41)
    assert found.displacements["rod.to"] == pytest.approx((0, 0, height - 40), abs=1e-6)
    assert list(found.held_back["coordinate"]) == (["rod.to z"] if height == 41 else [])
    length = np.hypot(np.sqrt(925), height)
    for moved, gain in found.held_back[["moved [mm]", "gain [1/mm]"]].to_numpy():
        assert moved == pytest.approx(1)
        assert gain == pytest.approx(2 * (wanted - length) / 0.5**2 * height / length, rel=1e-6)


@pytest.mark.slow
def test_bounds_are_kept_exactly_and_only_where_they_must() -> None:
    q = np.radians(np.linspace(-40, 40, 17))
    over = Sweep(Joint("crank"), q)
    wanted = np.degrees(0.3 * np.sin(q))
    angle = "transmission angle [deg]"
    target = Target("rocker", lambda m: np.degrees(m.joint("rocker")), over, wanted, offset=True)
    boxes = [Box("rod.from", (4, 4, 0)), Box("rod.to", (6, 4, 6))]

    def of(m: Motion) -> Any:
        return transmission(m, "rocker", "rod")[angle]

    free = fit(rssr(), [target], boxes, starts=1)
    least = float(of(free.motions[0]).min())
    bound = Bound(angle, of, over, least=least + 3, unit="deg")
    kept = fit(rssr(), [target], boxes, [bound], starts=1)
    assert kept.bounds["kept"].all()
    assert kept.bounds["least after"][0] == pytest.approx(least + 3, abs=1e-5)
    assert float(of(kept.mechanism.sweep(over.drive, q)).min()) == pytest.approx(least + 3, abs=1e-5)
    assert kept.targets["rms after"][0] > free.targets["rms after"][0]
    idle = fit(rssr(), [target], boxes, [Bound(angle, of, over, least=least - 3)], starts=1)
    assert idle.targets["rms after"][0] == pytest.approx(free.targets["rms after"][0], rel=1e-6)


def test_a_point_is_led_along_a_line_and_a_circle() -> None:
    over = Sweep(Joint("crank"), np.radians(np.linspace(-30, 30, 13)))

    def deviation(m: Motion) -> Any:
        return off_line(m.point("rocker", (45, 5, 30)), (45, 5, 30), (1, 0, 0.4))

    boxes = [Box("rod.from", 3), Box("rod.to", 3)]
    found = fit(rssr(), [Target("line", deviation, over, tolerance=0.01, unit="mm")], boxes, starts=1)
    assert found.targets["rms after"][0] < found.targets["rms before"][0]
    around = Target(
        "circle", lambda m: off_circle(m.point("rocker", (45, 5, 30)), (40, 5, 10), (0, -1, 0), np.hypot(5, 20)), over
    )
    at_once = fit(rssr(), [around], boxes, starts=1)
    assert at_once.targets["largest before"][0] < 1e-12  # every point of the rocker is on a circle
    assert at_once.undetermined == 6
    assert set(at_once.displacements.values()) == {(0.0, 0.0, 0.0)}


@pytest.mark.slow
def test_trials_that_do_not_move_are_refused_and_counted() -> None:
    """A rod so short that the crank cannot turn: the target asks for it, the sweep does not allow it."""
    over = Sweep(Joint("crank"), np.radians(np.linspace(0, 360, 25)))
    short = Target("length", lambda m: link_length(m, "rod"), over, 20.0)
    found = fit(rssr(), [short], [Box("rod.to", (20, 0, 25))], starts=1)
    assert sum(found.refused.values()) > 0
    assert any("refused: dead point" in line for line in found.remarks())
    assert not found.success
    again = found.mechanism.sweep(over.drive, over.values)
    assert again.success.all()


def test_a_mirrored_assembly_is_no_solution() -> None:
    """The same angles are made by the rod on the other side of the rocker's axis: not without passing a dead point."""
    q = np.radians(np.linspace(-20, 20, 9))
    given = rssr(rocker=(43, 5, 40))
    variables = Variables(given, [Box("rod.to", (0, 0, 60))])
    trials = Trials(variables, [Target("rocker", lambda m: m.joint("rocker"), Sweep(Joint("crank"), q))])
    assert trials.at(np.array([-1.0])) is None
    assert set(trials.refused) <= {"its design pose is another assembly", "dead point"}
    many = trials.batch(np.linspace(-1, 1, 9)[:, None])
    alone = [trials.at(np.array([u])) for u in np.linspace(-1, 1, 9)]
    assert [t is None for t in many] == [t is None for t in alone]
    for one, other in zip(many, alone, strict=True):
        if one and other:
            np.testing.assert_allclose(one.read[0], other.read[0], atol=1e-12)


def test_points_that_coincide_move_together() -> None:
    outer = OUTER.copy()
    outer[3] = outer[2]
    given = axle(outer=outer)
    variables = Variables(given, [Box("lower rear.to", (1, 2, 0))])
    moved = variables.moved(np.array([[1.0, 1.0]]))
    ends = {x.name: x.to for x in moved.elements if isinstance(x, Link)}
    assert ends["lower rear"] == ends["lower front"] == pytest.approx(outer[2] + (1, 2, 0))
    with pytest.raises(InvalidRequest, match="is in two boxes"):
        Variables(given, [Box("lower rear.to", 1), Box("lower front.to", 1)])


@pytest.mark.parametrize(
    ("boxes", "match"),
    [
        ([Box("tie rod", 1)], "there is no hard point 'tie rod', only upper rear.from"),
        ([Box("tie rod.to", (1, 2))], "must be a number or 3 numbers"),
        ([Box("tie rod.to", -1)], "0 or more"),
        ([Box("tie rod.to", 0)], "nothing may move"),
        ([Box([], 1)], "about hard points, by their names"),
        ([Box("tie rod.to", "wide")], "must be a number or 3 numbers"),  # type: ignore[arg-type]  # what is tried
        ([Box("tie rod.to", 1, mirror="left")], "mirror must be one of '', 'x', 'y', 'z'"),
    ],
)
def test_wrong_boxes_are_one_line(boxes: list[Box], match: str) -> None:
    with pytest.raises(InvalidRequest, match=match) as caught:
        fit(axle(), targets(axle(), "toe [deg]"), boxes)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_what_cannot_be_meant_is_refused() -> None:
    box = [Box("tie rod.to", 1)]
    toe = column("toe [deg]")
    with pytest.raises(InvalidRequest, match="tolerance must be a finite number above zero"):
        Target("toe", toe, BUMP, tolerance=0)
    with pytest.raises(InvalidRequest, match="values of a Sweep must be finite"):
        Sweep(BUMP.drive, [0, np.nan])
    with pytest.raises(InvalidRequest, match="toe: values must be finite numbers"):
        fit(axle(), [Target("toe", toe, BUMP, "flat")], box)
    with pytest.raises(InvalidRequest, match="needs least or most"):
        Bound("toe", toe, BUMP)
    with pytest.raises(InvalidRequest, match=r"values of shape \(4,\) for readings of shape \(9, 1\)"):
        fit(axle(), [Target("toe", toe, BUMP, [0, 1, 2, 3])], box)
    with pytest.raises(InvalidRequest, match="a number or a vector for each pose"):
        fit(axle(), [Target("toe", lambda _: 1.0, BUMP)], box)
    with pytest.raises(InvalidRequest, match="give a Target"):
        fit(axle(), [], box)
    with pytest.raises(NotMovable, match=r"no start gets through all sweeps \(16 trials: dead point"):
        fit(axle(), [Target("toe", toe, Sweep(BUMP.drive, [0, 2000]))], box)
    unnamed = Mechanism([Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)])
    with pytest.raises(InvalidRequest, match="5 hard points are called"):
        fit(unnamed, targets(axle(), "toe [deg]"), [Box("Link ground-wheel.to", 1)])
    guided = Mechanism(
        [Spherical("body", (0, 0, 0), name="ball"), OnGuide("body", (1, 0, 0), "sphere", (1,), name="ring")]
    )
    with pytest.raises(InvalidRequest, match="on a guide, which stays"):
        Variables(guided, [Box("ring.at", 1)])


def test_stacked_motions_are_read_by_what_a_motion_is_read_by() -> None:
    """A method that `Motion` calls by another name would read every pose with the hard points of the first."""
    for name in ("flat", "each"):
        assert name in vars(Stacked)
        assert name in vars(Motion)
