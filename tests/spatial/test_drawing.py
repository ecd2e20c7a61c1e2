"""Pictures of mechanisms in space: drawn where things are, at one scale, and only when they are asked for."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from catalogue.cli import app
from catalogue.errors import InvalidRequest, MissingExtra
from catalogue.folders import folder
from catalogue.kinematics.types import Array
from catalogue.spatial import Joint, Link, Mechanism, Motion, OnGuide, Prismatic, Revolute, load
from catalogue.spatial.drawing.figure import AZIMUTHS, ELEVATIONS, Sheet, hull, nice, toward, view
from catalogue.spatial.drawing.lettering import Letters
from catalogue.spatial.drawing.scene import Scene
from catalogue.spatial.jointed.picture import scene

pytest.importorskip("matplotlib")
FOLDER = folder("data") / "spatial"


@pytest.fixture(scope="module")
def rssr() -> Motion:
    return load(FOLDER / "rssr.toml").mechanism.sweep(Joint("crank"), np.radians([-30.0, 0, 30, 60]))


def test_the_pose_nearest_to_the_design_pose_is_drawn_in_full_and_the_ends_as_ghosts(rssr: Motion) -> None:
    seen = scene(rssr.mechanism, rssr)
    [rod] = seen.links
    np.testing.assert_allclose(rod.ends[0], [(10, 0, 0), (40, 5, 40)], atol=1e-12)
    for ghost, pose in ((1, 0), (2, 3)):
        np.testing.assert_allclose(rod.ends[ghost, 0], rssr.point("crank", (10, 0, 0))[pose], atol=1e-12)
        np.testing.assert_allclose(rod.ends[ghost, 1], rssr.point("rocker", (40, 5, 40))[pose], atol=1e-12)
    assert [b.name for b in seen.bodies] == ["crank", "rocker"]
    assert [a.turns for a in seen.axes] == [True, True]
    np.testing.assert_allclose(seen.axes[1].direction[0], (0, 1, 0))


def test_a_wheel_is_a_circle_about_its_axis_and_its_centre_is_followed() -> None:
    job = load(FOLDER / "five_link_axle.toml")
    assert job.wheel is not None
    motion = job.mechanism.sweep(job.drive("travel"), np.linspace(-60, 60, 5), [job.drive("rack")])
    seen = scene(job.mechanism, motion, [one.wheel for one in job.wheels])
    n, centre = motion.direction("wheel", job.wheel.outboard()), motion.point("wheel", job.wheel.centre)
    for k, pose in enumerate((2, 0, 4)):
        off = seen.rings[0][k] - centre[pose]
        np.testing.assert_allclose(off @ n[pose], 0, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(off, axis=1), job.wheel.radius, rtol=1e-12)
    np.testing.assert_array_equal(seen.paths["wheel centre"], centre)


@pytest.mark.slow
def test_scales_are_equal_and_all_is_on_the_paper(rssr: Motion) -> None:
    from catalogue.paper import blank

    seen = scene(rssr.mechanism, rssr)
    sheet = Sheet(blank(9, 7), seen)
    at = np.array([20.0, 5, 10])
    step = sheet.flat(at + 3 * np.eye(3)) - sheet.flat(at)
    # in a parallel projection the columns of a matrix with orthogonal rows of one length
    gram = step.T @ step
    assert gram[0, 0] == pytest.approx(gram[1, 1], rel=1e-6)
    assert gram[0, 1] == pytest.approx(0, abs=1e-6 * gram[0, 0])
    flat, box = sheet.flat(seen.places), sheet.figure.bbox
    assert (flat > 0).all()
    assert (flat[:, 0] < box.width).all()
    assert (flat[:, 1] < 0.92 * box.height).all()


@pytest.mark.parametrize("name", ["double_wishbone", "platform"])
def test_what_is_shown_fills_the_paper_and_stands_in_its_middle(name: str) -> None:
    from catalogue.paper import blank

    sheet = Sheet(blank(9, 7), scene(load(FOLDER / f"{name}.toml").mechanism))
    flat, box = sheet.flat(sheet.scene.places), sheet.ax.get_window_extent()
    np.testing.assert_allclose(
        (flat.min(0) + flat.max(0)) / 2, [(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2], atol=0.1
    )
    assert max(np.ptp(flat, axis=0) / [0.86 * box.width, 0.84 * box.height]) == pytest.approx(1, rel=1e-6)


def test_the_room_of_a_text_is_about_what_it_takes() -> None:
    """That is what other texts keep off; widths of letters differ."""
    from catalogue.paper import blank

    figure = blank(6, 6)
    letters = Letters(figure)
    for text in ("lower wishbone", "tie rod", "rack", "A1"):
        for bold in (False, True):
            letters.write(text, 300 * np.ones((1, 2)), "k", bold)
            box = figure.texts[-1].get_window_extent()
            assert 0.8 * box.width < 2 * letters.taken[-1][2] < 1.5 * box.width
            assert 0.8 * box.height < 2 * letters.taken[-1][3] < 2 * box.height
        assert letters.taken[-1][2] > letters.taken[-2][2]


def test_title_and_note_stand_on_the_paper_above_the_mechanism(rssr: Motion) -> None:
    seen = scene(rssr.mechanism, rssr)
    figure = rssr.plot()
    places = {text.get_text(): text.get_position()[1] for text in figure.texts}
    top = 1 - figure.axes[0].get_position().height
    assert 1 - top < places[seen.note] < places[seen.title] - 0.02 < 0.97


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cardan", "platform", "five_link_axle"])
def test_examples_are_drawn(name: str, tmp_path: Path) -> None:
    job = load(FOLDER / f"{name}.toml")
    first, *others = job.drives.values()
    hold = others[: job.mechanism.mobility.freedoms - 1]
    system = job.mechanism.system(*hold, first)
    start = system.evaluate(system.design[None])[1][0, -1] * system.scalars[-1].unit
    motion = job.mechanism.sweep(first, start + np.array([-0.2, 0, 0.2]), hold)
    figure = job.plot(motion, tmp_path / "motion.png")
    for x in job.mechanism.elements:
        if isinstance(x, Link):
            assert any(text.get_text().startswith(f"{x.name}  ") for text in figure.texts)
    assert (tmp_path / "motion.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_the_same_mechanism_gives_the_same_file(tmp_path: Path, rssr: Motion) -> None:
    for name in ("one.svg", "two.svg"):
        rssr.mechanism.plot(tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()


def test_guides_and_sliders_are_drawn_where_they_are() -> None:
    at = np.array([3.0, 0, 4])
    mechanism = Mechanism(
        [
            Prismatic("slide", (0, 0, 1), at=(3, 0, 0)),
            OnGuide("ball", at, "sphere", (5.0,), name="dome"),
            Link("slide", (3, 0, 2), "ball", (3, 1, 3), "a"),
            Link("ground", (0, 6, 2), "ball", (3, 1, 3), "b"),
            OnGuide("ball", (5, 0, 4), "line", origin=(5, 0, 0), name="rail"),
        ]
    )
    seen = scene(mechanism)
    [(name, patch)] = seen.patches
    assert name == "dome"
    np.testing.assert_allclose(np.linalg.norm(patch, axis=-1), 5, rtol=1e-12)
    [(name, curve)] = seen.curves
    assert name == "rail"
    np.testing.assert_allclose(curve[0, :, :2], np.broadcast_to((5, 0), (len(curve[0]), 2)), atol=1e-12)
    assert curve[0, :, 2].min() < 4 < curve[0, :, 2].max()
    [axis] = seen.axes
    assert (axis.turns, axis.slides) == (False, True)


def test_dots_stand_at_the_ends_of_what_there_is_of_a_path(rssr: Motion) -> None:
    from catalogue.paper import blank

    seen = replace(scene(rssr.mechanism, rssr), paths={"pin": rssr.point("rocker", (40, 5, 40))})
    seen.paths["pin"][0] = np.nan  # as where the mechanism does not close
    sheet = Sheet(blank(4, 4), seen)
    sheet.paths()
    path, *ends = (np.transpose(line.get_data_3d()) for line in sheet.ax.lines)
    np.testing.assert_array_equal(path, seen.paths["pin"][1:])
    np.testing.assert_array_equal(np.concatenate(ends), seen.paths["pin"][[1, -1]])


@pytest.mark.parametrize(("name", "drive"), [("rssr", "crank"), ("cardan", "input")])
def test_ghosts_are_thinner_than_what_is_drawn_in_full(name: str, drive: str) -> None:
    from catalogue.paper import blank

    mechanism = load(FOLDER / f"{name}.toml").mechanism
    seen = scene(mechanism, mechanism.sweep(Joint(drive), [-0.2, 0, 0.2]))
    for body in seen.bodies:
        full, ghost = Sheet(blank(4, 4), seen), Sheet(blank(4, 4), seen)
        full.body(body, 0)
        ghost.body(body, 1)
        one, other = (
            [line.get_linewidth() for line in sheet.ax.lines if line.get_color() == sheet.colours[body.name]]
            for sheet in (full, ghost)
        )
        assert max(one) > max(other)


def test_borders_of_flat_and_solid_bodies() -> None:
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0)], float)
    edges, faces = hull(square)
    assert {frozenset(e) for e in edges} == {frozenset(e) for e in ((0, 1), (1, 2), (2, 3), (3, 0))}
    assert len(faces) == 2
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    assert len(hull(cube)[0]) == 12
    assert hull(square[[0, 4, 2]])[0] in ([(0, 2)], [(2, 0)])
    assert hull(square[:1])[0] == []
    assert [nice(v) for v in (0.99, 1, 3, 49, 50, 0.0021)] == [0.5, 1, 2, 20, 50, 0.002]


def test_texts_do_not_cover_each_other() -> None:
    from catalogue.paper import blank

    figure = blank(5, 4)
    letters = Letters(figure)
    for k in range(6):
        letters.write(f"link {k}", np.array([[200.0, 200], [300, 200]]), "black")
    for i, a in enumerate(letters.taken):
        for b in letters.taken[:i]:
            assert (np.abs(a[:2] - b[:2]) >= a[2:] + b[2:]).any()


def test_curves_are_those_of_the_table(rssr: Motion) -> None:
    table = pd.DataFrame({"drive [deg]": rssr.drive_shown, "rocker [deg]": np.degrees(rssr.joint("rocker"))})
    figure = rssr.plot_curves(table)
    [panel] = [ax for ax in figure.axes if ax.get_visible()]
    drawn = np.asarray(panel.lines[0].get_xydata())
    np.testing.assert_allclose(drawn, table.to_numpy())
    assert panel.get_title("left") == "rocker [deg]"
    assert panel.get_xlabel() == "drive [deg]"
    with pytest.raises(InvalidRequest, match="25 columns"):
        rssr.plot_curves(pd.DataFrame({f"c{k}": table["rocker [deg]"] for k in range(25)}))


@pytest.mark.slow
def test_the_command_draws(tmp_path: Path) -> None:
    picture, curves = tmp_path / "axle.svg", tmp_path / "curves.svg"
    motion = ["--drive", "travel", "--hold", "rack", "--from", "-8", "--to", "8", "--steps", "3"]
    files = ["--plot", str(picture), "--plot-curves", str(curves)]
    sweep = ["spatial", "sweep", str(FOLDER / "double_wishbone.toml"), *motion, "--columns"]
    given = [*sweep, "toe,camber", *files]
    done = CliRunner().invoke(app, given)
    assert done.exception is None, done.output
    assert "toe [deg]" in done.stdout
    assert "caster" not in done.stdout
    assert "travel of wheel from -8 to 8 mm" in picture.read_text("utf-8")
    assert "camber [deg]" in curves.read_text("utf-8")
    assert "is there already" in str(CliRunner().invoke(app, given).exception)
    wrong = CliRunner().invoke(app, [*sweep, "rope"])
    assert "no column is headed 'rope'" in str(wrong.exception)


def test_batches_and_wrong_files_are_refused(tmp_path: Path, rssr: Motion) -> None:
    many = Mechanism(
        [Revolute("a", (0, 0, 0), axis=(0, 0, 1)), Link("a", [(1, 0, 0), (2, 0, 0)], "b", (4, 0, 0)),
         Revolute("b", (4, 1, 0), axis=(0, 0, 1))]
    )  # fmt: skip
    with pytest.raises(InvalidRequest, match="not of a batch"):
        many.plot()
    with pytest.raises(InvalidRequest, match=r"\.png, \.svg or \.pdf"):
        rssr.plot(tmp_path / "a.gif")


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, rssr: Motion) -> None:
    for module in ("matplotlib.figure", "matplotlib.backends.backend_agg"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtra, match=r'pip install "mechanism-catalogue\[plot\]"'):
        rssr.plot()


@pytest.mark.slow
def test_a_sweep_without_pictures_loads_no_matplotlib() -> None:
    code = (
        "import sys, catalogue.spatial as s; job = s.load(sys.argv[1]);"
        "job.table(job.mechanism.sweep(s.Joint('crank'), [0.1, 0.2]));"
        "import catalogue.spatial.fitting.files;"
        "assert not [m for m in sys.modules if m.startswith('matplotlib')]"
    )
    subprocess.run([sys.executable, "-c", code, str(FOLDER / "rssr.toml")], check=True)


def test_two_joints_are_seen_from_where_they_are_farthest_apart() -> None:
    directions = [toward(e, a) for e in ELEVATIONS for a in AZIMUTHS]
    for way in np.random.default_rng(1).normal(size=(12, 3)):
        seen = Scene([], [], [], np.stack([0 * way, way])[None], np.zeros((0, 3)), [], [], [], {}, "", "", "mm")
        apart = [np.linalg.norm(np.cross(way, to)) for to in (*directions, toward(*view(seen)))]
        assert apart[-1] == pytest.approx(max(apart), rel=1e-9)


def test_a_cross_is_named_in_the_design_pose_alone() -> None:
    from catalogue.paper import blank

    seen = scene(load(FOLDER / "cardan.toml").mechanism)
    assert any(body.rods.size for body in seen.bodies)
    sheet = Sheet(blank(4, 4), seen)
    sheet.names()
    assert {body.name for body in seen.bodies} <= {text.get_text() for text in sheet.figure.texts}


def test_names_leave_links_bodies_and_the_arms_of_a_cross_free(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of the way along each, and at nine tenths, to within the distance of what is kept free."""
    from catalogue.paper import blank

    made = []
    keep_off = Letters.keep_off

    def noted(self: Letters, x: Array, half: float = 1.0) -> None:
        made.append(x)
        keep_off(self, x, half)

    monkeypatch.setattr(Letters, "keep_off", noted)
    for name in ("cardan", "rssr"):
        seen = scene(load(FOLDER / f"{name}.toml").mechanism)
        sheet = Sheet(blank(9, 7), seen)
        made.clear()
        sheet.names()
        kept = np.concatenate(made)
        lines = [*(one.ends[0] for one in seen.links), *(rod for body in seen.bodies for rod in body.rods[0])]
        assert lines
        for a, b in lines:
            between = sheet.flat(np.array([0.9 * a + 0.1 * b, 0.1 * a + 0.9 * b]))
            step = np.linalg.norm(np.subtract(*sheet.flat(np.array([a, b])))) / 24
            assert (np.linalg.norm(kept - between[:, None], axis=2).min(1) <= step).all()


def test_over_a_grid_a_point_is_followed_along_its_first_drive() -> None:
    job = load(folder("data") / "spatial" / "double_wishbone.toml")
    grid = job.sweep({"travel": [-40, -10, 20], "rack": [-5, 0, 5]}, {}, grid=True)
    seen = scene(job.mechanism, grid, [one.wheel for one in job.wheels])
    alone = job.sweep({"travel": [-40, -10, 20]}, {"rack": 0.0})
    assert job.wheel is not None
    np.testing.assert_allclose(seen.paths["wheel centre"], alone.point("wheel", job.wheel.centre), atol=1e-9)
    path = job.sweep({"travel": [-40, -10, 20], "rack": [-5, 0, 5]}, {})
    assert len(scene(job.mechanism, path, [one.wheel for one in job.wheels]).paths["wheel centre"]) == 3
