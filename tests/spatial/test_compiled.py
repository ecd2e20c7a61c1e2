"""Sweeps by numba and by numpy are the same, to rounding."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.progress import PATIENCE
from catalogue.spatial import (
    Angle,
    Cylindrical,
    Joint,
    KeepAngle,
    Length,
    Link,
    Mechanism,
    OnGuide,
    Prismatic,
    Revolute,
    Screw,
    Spherical,
    Travel,
)
from catalogue.spatial.continuation import tracing
from catalogue.spatial.jointed import compiled
from catalogue.spatial.jointed.circuit import Circuit
from catalogue.spatial.jointed.curve import signature
from catalogue.spatial.native import loading
from tests.attacks.spatial_folds import drawn
from tests.spatial.test_axles import BALLS, CENTRE, INNER, LOWER, OUTER, ROD, UPPER
from tests.spatial.test_jointed import RSSR, random_mechanism, rssr

pytestmark = pytest.mark.slow  # also what imports numba alone takes a second
needs_numba = pytest.mark.skipif(find_spec("numba") is None, reason="numba, of the extra `fast`, is not installed")
CRANK = Revolute("crank", (0, 0, 0), axis=(0, 0, 1))
TILTED, BESIDE = (0.3, 0.4, 1.0), (4.0, 0.5, 0.2)
#: Elements, drive, what is held, values: every joint, condition and scalar that the kernel knows.
EXAMPLES: dict[str, tuple[list[Any], Any, list[Any], Any]] = {
    "five links": (
        [Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)],
        Travel("wheel", CENTRE), [], np.linspace(-80, 80, 41),
    ),
    "beyond both dead points": (
        [Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)],
        Travel("wheel", CENTRE), [], np.linspace(-1600, 1600, 81),
    ),
    "the sum of a turn and of another, and of two travels that are held": (
        [CRANK, Revolute("b", (2, 0, 0), axis=(0, 1, 0), on="crank"), Revolute("c", (3, 1, 0), axis=(0, 0, 1), on="b")],
        Angle("crank", (1, 0, 0), (0, 0, 1)) + Joint("c"),
        [Travel("c", (4, 1, 0), "y") - Travel("b", (3, 0, 0), "y") * 0.5, Joint("b")], np.linspace(-1, 1, 21),
    ),
    "double wishbone": (
        [
            Revolute("lower", LOWER[0], to=LOWER[1]), Revolute("upper", UPPER[0], to=UPPER[1]),
            Spherical("wheel", BALLS[0], on="lower"), Spherical("wheel", BALLS[1], on="upper"),
            Link("ground", ROD[0], "wheel", ROD[1]),
        ],
        Travel("wheel", CENTRE, (0.1, 0.2, 1)), [], np.linspace(-60, 60, 31),
    ),
    "arm on a body that links lead": (
        [
            *(Link("ground", a, "wheel", b) for a, b in zip(INNER, OUTER, strict=True)),
            Revolute("arm", (20, 730, -60), axis=(0.2, 0.1, 1), on="wheel"),
            Link("ground", (120, 480, -150), "arm", (160, 720, -50)),
        ],
        Travel("wheel", CENTRE), [], np.linspace(-30, 30, 13),
    ),
    "full turn, by the angle of a direction": (
        list(rssr(*RSSR).elements), Angle("crank", (1, 0, 0), (0, 0, 1)), [], np.linspace(-3, 3, 61),
    ),
    "slider by a rod that turns idly": (
        [
            CRANK, Prismatic("piston", TILTED, at=BESIDE), Spherical("rod", (1, 0, 0), on="crank"),
            Spherical("rod", BESIDE, on="piston"),
        ],
        Joint("crank"), [], np.linspace(-3, 3, 41),
    ),
    "length of a leg, screw on an arm": (
        [
            CRANK, Revolute("arm", (2, 0, 0.3), axis=TILTED, on="crank"),
            Screw("nut", (3, 0.2, 0.3), axis=(0, 1, 0.2), on="arm", lead=0.7),
            Link("ground", (3.1, 1.5, 2), "nut", (3.3, 0.5, 0.9)), Link("ground", (1, 2, 1), "nut", (3.1, 0.3, 1.2)),
        ],
        Length("ground", (0, 3, 1), "nut", (3.5, 0.2, 0.4)), [], np.linspace(4.2, 4.8, 21),
    ),
    "planar four-bar of revolute joints, overconstrained": (
        [
            CRANK, Revolute("rocker", (4, 0, 0), axis=(0, 0, 1)),
            Revolute("coupler", (1, 0, 0), axis=(0, 0, 1), on="crank"),
            Revolute("coupler", (3.5, 3, 0), axis=(0, 0, 1), on="rocker"),
        ],
        Joint("crank"), [], np.linspace(-1, 1, 21),
    ),
    "two freedoms, one held": (
        [
            Cylindrical("tube", (0, 0, 0), axis=TILTED), Link("ground", (3, 0, 1), "plate", (2, 0.4, 2)),
            Link("ground", (0, 3, 1), "plate", (0.4, 2, 2)), Spherical("plate", (0.5, 0.6, 1.5), on="tube"),
            KeepAngle("ground", (1, 0, 0), "plate", (0, 1, 0.2)),
        ],
        Joint("tube", 1), [Angle("plate", (1, 0, 0), (0, 0, 1))], np.linspace(-0.05, 0.05, 11),
    ),
}  # fmt: skip


def by_numpy(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(compiled, "kernel", lambda: None)


def both(monkeypatch: pytest.MonkeyPatch, run: Any) -> tuple[Any, Any]:
    """Return what a call gives compiled and by numpy; it must make its mechanism itself."""
    with monkeypatch.context() as patch:
        by_numpy(patch)
        plain = run()
    return run(), plain


def same(one: Any, other: Any) -> None:
    """Two motions are the same."""
    assert one.curve.system.fast
    assert other.curve.system.fast is None
    assert (np.isfinite(one.states) == np.isfinite(other.states)).all()
    who, which = np.nonzero(np.isfinite(one.states).all(-1))
    # where bodies and ends are: how far a rod has turned idly, nothing says
    poses, there = (signature(m.curve.take(who), m.states[who, which]) for m in (one, other))
    # next to a dead point an error is as large as its square root
    assert np.abs(poses - there).max(initial=0) < 1e-9
    assert np.median(np.abs(poses - there)) < 1e-14
    for mine, theirs in zip(one.ends, other.ends, strict=True):
        for end, there in zip(mine, theirs, strict=True):
            assert (end is None) == (there is None)
            if end is not None:
                assert end == (pytest.approx(there[0], rel=1e-9, abs=1e-9), there[1])


@needs_numba
@pytest.mark.parametrize("name", EXAMPLES)
def test_a_sweep_is_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    elements, drive, hold, values = EXAMPLES[name]
    one, other = both(monkeypatch, lambda: Mechanism(elements).sweep(drive, values, hold))
    assert one.success.any()
    same(one, other)


@needs_numba
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_equations_are_the_same(name: str) -> None:
    """Residual, values and Jacobian, in poses that satisfy nothing."""
    elements, drive, hold, _ = EXAMPLES[name]
    system = Mechanism(elements).system(*hold, drive)
    y = np.repeat(system.design[None], 50, axis=0)
    y = system.moved(y, np.random.default_rng(1).normal(size=(50, system.unknowns)))
    residual, values, jacobian = system.evaluate(y)
    assert system.fast
    both, slopes = compiled.evaluate(system.fast, y)
    np.testing.assert_allclose(both, np.concatenate([residual, values], axis=1), atol=2e-14)
    np.testing.assert_allclose(slopes, jacobian, atol=2e-14)


@needs_numba
@pytest.mark.parametrize("name", EXAMPLES)
def test_rates_and_twists_are_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    elements, drive, hold, values = EXAMPLES[name]
    one, other = both(monkeypatch, lambda: Mechanism(elements).sweep(drive, values, hold))
    plain = replace(other, states=one.states, _cache={})
    assert plain.curve.system.fast is None
    np.testing.assert_allclose(one.poses()[0], plain.poses()[0], atol=1e-13)
    steep = 1 + np.abs(plain.basis()).max((1, 2), keepdims=True)  # near dead points
    assert np.nanmax(np.abs(one.basis() - plain.basis()) / steep**2) < 1e-12
    assert np.nanmax(np.abs(one.twists() - plain.twists()) / steep[..., None] ** 2) < 1e-12


@needs_numba
def test_random_mechanisms_move_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """150 five links, RSCR and RSSR, most of which do not get as far as asked."""
    draw = np.random.default_rng(8)
    ended = 0
    for k in range(150):
        mechanism, drive, values = random_mechanism(draw, k % 3)
        one, other = both(monkeypatch, lambda m=mechanism, d=drive, v=values: Mechanism(m.elements).sweep(d, v))
        same(one, other)
        ended += sum(end is not None for end in one.ends[0])
    assert ended > 100


@needs_numba
@pytest.mark.parametrize("kind", ["RSSR", "RSCR", "five links"])
def test_batches_and_circuits_are_the_same(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def run() -> tuple[Any, list[Circuit]]:
        mechanism, drive, _ = drawn(kind, 12, np.random.default_rng(5))
        return mechanism.sweep(drive, np.linspace(-0.5, 0.5, 21)), mechanism.circuits(drive)

    (swept, circuits), (there, others) = both(monkeypatch, run)
    same(swept, there)
    for one, other in zip(circuits, others, strict=True):
        assert (one.closed, one.crank, one.reason) == (other.closed, other.crank, other.reason)
        assert one.dead_points == pytest.approx(other.dead_points, abs=1e-9)


@needs_numba
def test_a_matrix_that_is_singular_is_left_to_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel that calls every matrix singular changes nothing."""
    real = compiled.swept

    def singular(*a: Any) -> Any:
        states, end, why, where = real(*a)
        return np.full_like(states, np.nan), end * 0, why * 0, np.ones_like(where)

    elements, drive, hold, values = EXAMPLES["five links"]
    with monkeypatch.context() as patch:
        patch.setattr(compiled, "swept", singular)
        one = Mechanism(elements).sweep(drive, values, hold)
    same(one, both(monkeypatch, lambda: Mechanism(elements).sweep(drive, values, hold))[1])


@needs_numba
def test_the_tests_of_a_step_are_those_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever changes a constant of a step changes it for both: here no step may turn, so that none is made."""
    monkeypatch.setattr(tracing, "LIMITS", tracing.LIMITS._replace(refused=0.0))
    one, other = both(monkeypatch, lambda: rssr(*RSSR).sweep(Joint("crank"), [0.5]))
    assert one.ends == other.ends == ((None, (0.0, "step too small")),)


@needs_numba
def test_one_set_of_types_is_compiled() -> None:
    """Arrays of another layout would be compiled for anew, for half a minute."""
    for elements, drive, hold, values in EXAMPLES.values():
        mechanism = Mechanism(elements)
        mechanism.sweep(drive, list(values[::-1]), hold)
        mechanism.sweep(drive, np.asfortranarray(values)[::2], hold)
    kernel = compiled.kernel()
    assert kernel is not None
    for entry in (kernel.evaluated, kernel.swept, kernel.steps, kernel.solved):
        assert len(entry.signatures) <= 1


@needs_numba
def test_what_numba_has_kept_of_another_version_is_not_taken(tmp_path: Path) -> None:
    """It looks at the file of a kept function alone: the version of all files is among the types of each."""
    from catalogue.spatial.geometry.guides import KINDS
    from catalogue.spatial.guided import kernel as guided
    from catalogue.spatial.jointed import kernel as jointed
    from catalogue.spatial.native.compiling import version

    versions = {guided: version(str(guided.__file__), repr([*KINDS])), jointed: version(str(jointed.__file__))}
    kept = [(room, value) for room in versions for value in vars(room).values() if hasattr(value, "py_func")]
    assert len(kept) == 7
    for room, function in kept:
        assert list(inspect.signature(function.py_func).parameters.values())[-1].default == versions[room]
        assert all("omitted" in str(types[-1]) for types in function.signatures)
    (tmp_path / "one.py").write_text("1")
    first = version(str(tmp_path / "one.py"))
    assert version(str(tmp_path / "one.py")) == first
    assert version(str(tmp_path / "one.py"), "torus") != first
    (tmp_path / "two.py").write_text("2")
    second = version(str(tmp_path / "one.py"))
    (tmp_path / "two.py").write_text("3")
    assert len({first, second, version(str(tmp_path / "one.py"))}) == 3


@needs_numba
def test_what_numba_has_kept_is_compiled_anew_where_another_file_has_changed(tmp_path: Path) -> None:
    """A function that is kept calls one of another file, which is another one in a later version."""
    folder = tmp_path / "kernel"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "entry.py").write_text(
        "from catalogue.spatial.native.compiling import kept, version\n"
        "from .inner import number\n"
        "@kept\n"
        "def read(version=version(__file__)):\n"
        "    return number()\n"
    )

    def told(number: float) -> float:
        inner = f"from catalogue.spatial.native.compiling import compiled\n@compiled\ndef number(): return {number}\n"
        (folder / "inner.py").write_text(inner)
        command = [sys.executable, "-c", "from kernel.entry import read; print(read())"]
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kept")}
        return float(subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True).stdout)

    assert told(1.0) == 1.0
    assert list((tmp_path / "kept").rglob("*.nbc"))
    assert told(2.5) == 2.5


def test_who_waits_for_the_compiler_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    class Waiting:
        """As a function of numba, which is compiled when it is called first."""

        overloads: ClassVar[list[str]] = []

        def __call__(self, number: float) -> float:
            if not self.overloads:
                time.sleep(1.2 * PATIENCE)
                self.overloads.append("float64")
            return 2 * number

    function = Waiting()
    assert loading.call(function, 2.0) == 4.0
    assert capsys.readouterr().err == "compiling sweeps in space, for this and later processes ...\n"
    assert loading.call(function, 3.0) == 6.0
    assert capsys.readouterr().err == ""


@needs_numba
def test_a_guide_that_is_a_surface_is_left_to_numpy() -> None:
    on: list[Any] = [
        OnGuide("body", (0, 0, 0), "plane"),
        *(Link("ground", (k, 1, k), "body", (k, 0, 0.1)) for k in range(1, 5)),
    ]
    assert Mechanism(on).system().fast is None


def test_numpy_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled.kernel.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(loading, "find_spec", lambda _: None)
        assert compiled.kernel() is None
    compiled.kernel.cache_clear()
    with monkeypatch.context() as patch:
        patch.setenv("NUMBA_DISABLE_JIT", "1")
        assert compiled.kernel() is None
    compiled.kernel.cache_clear()


def test_numba_that_cannot_be_imported_is_told_of_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where numpy is newer than it allows."""
    compiled.kernel.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(loading, "find_spec", lambda _: True)
        patch.setitem(sys.modules, "numba", None)
        for name in [name for name in sys.modules if name.startswith("catalogue.spatial.jointed.kernel")]:
            patch.delitem(sys.modules, name)
        patch.delitem(sys.modules, "catalogue.spatial.native.compiling", raising=False)
        patch.delattr("catalogue.spatial.jointed.kernel", raising=False)
        with pytest.warns(RuntimeWarning, match="sweeps go by numpy"):
            motion = rssr(*RSSR).sweep(Joint("crank"), [0.0, 0.1])
        assert motion.success.all()
        rssr(*RSSR).sweep(Joint("crank"), [0.0, 0.1])
    compiled.kernel.cache_clear()


def test_numba_is_imported_by_a_sweep_and_by_nothing_before() -> None:
    code = """
import sys
import catalogue, catalogue.spatial
from catalogue.spatial import *
m = Mechanism([Revolute("crank", (0, 0, 0), axis=(0, 0, 1)), Revolute("rocker", (4, 0, 1), axis=(0, 1, 0)),
               Link("crank", (1, 0, 0), "rocker", (4, 0.5, 4))])
m.mobility
assert not [name for name in sys.modules if name.startswith(("numba", "llvmlite"))]
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_the_names_of_sorts_are_the_same_as_the_integers_of_the_kernel() -> None:
    if find_spec("numba") is None:
        pytest.skip("numba, of the extra `fast`, is not installed")
    from catalogue.spatial.jointed import kernel, tree

    for name in ("REVOLUTE", "PRISMATIC", "CYLINDRICAL", "FREE"):
        assert getattr(kernel, name) == getattr(tree, name)
