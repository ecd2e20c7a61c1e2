"""Golden mechanisms, random linkages, and loops closed in 50 digits."""

from __future__ import annotations

import os

# Before NumPy is imported: threads of processes that test side by side would fight for the cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

import json
import pickle
import re
import runpy
import sqlite3
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from functools import partialmethod
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

if os.environ.get("TEST_DOUBLE"):  # as on platforms on which long double is double: Windows, macOS on ARM
    vars(np).update(longdouble=np.float64, clongdouble=np.complex128)

import pytest
from alembic import command
from alembic.config import Config
from hypothesis import settings

import catalogue
from catalogue.find import dwells, find, prescribed_pivots
from catalogue.find.explain import Advice, Explanation
from catalogue.folders import folder
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR, Linkage
from catalogue.kinematics.types import Array
from catalogue.progress import busy
from catalogue.search.search import Budget, Search
from catalogue.search.starts import SearchReport
from catalogue.spatial.guided import compiled as guided
from catalogue.spatial.jointed import compiled as jointed
from catalogue.store import Base
from catalogue.store.engine import engine_for

#: Checks of the contracts in `catalogue.testing` that take seconds.
SLOW = {
    "test_a_given_radius_is_kept",
    "test_a_piece_is_drawn",
    "test_classes_are_those_of_the_draw",
    "test_draws_are_declared_and_repeatable",
    "test_guides_touch_the_finite_motion_to_their_order",
    "test_what_is_laid_stays_where_it_is",
    "test_what_is_stored_is_measured_again_at_any_stroke",
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the slow checks that are inherited, as there is no place of their own to do it."""
    for item in items:
        if getattr(item, "originalname", "") in SLOW and isinstance(item.parent, pytest.Class):
            item.add_marker(pytest.mark.slow)


GOLDEN = Path(__file__).with_name("golden") / "planar.json"

# How long a case takes says how busy the machine is, not what is right; every run draws other examples.
settings.register_profile("untimed", deadline=None, max_examples=40)
settings.load_profile("untimed")


@pytest.fixture(scope="session", autouse=True)
def _answers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the answers of all tests in a file of theirs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CATALOGUE_ANSWERS", str(tmp_path_factory.mktemp("answers") / "answers.db"))
        yield


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the run, which all workers share."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@contextmanager
def alone(lock: Path) -> Iterator[None]:
    """Wait until no other worker is inside for the same file."""
    with closing(sqlite3.connect(lock, timeout=600, isolation_level=None)) as held:
        held.execute("BEGIN EXCLUSIVE")  # until it is closed
        yield


@pytest.fixture(scope="session")
def once(shared: Path) -> Callable[[str, Callable[[Path], object]], Path]:
    """Return a maker of files and folders, each made once for all workers; do not write to them."""

    def made(name: str, make: Callable[[Path], object]) -> Path:
        path, begun = shared / name, shared / f"begun-{name}"
        with alone(shared / f"{name}.lock"):
            if not path.exists():
                make(begun)
                begun.rename(path)
        return path

    return made


@pytest.fixture(scope="session", autouse=True)
def _bytecode_once(shared: Path) -> Iterator[None]:
    """Let processes that tests start compile each module once in the whole run, and leave nothing in the checkout."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
        patch.setenv("PYTHONPYCACHEPREFIX", str(shared / "bytecode"))
        yield


@pytest.fixture(scope="session", autouse=True)
def _compiled_once(shared: Path) -> Iterator[None]:
    """Let one worker at a time compile sweeps in space; the next loads what numba has kept."""

    @contextmanager
    def waiting(label: str) -> Iterator[None]:
        with alone(shared / "numba.lock"), busy(label):
            yield

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("catalogue.spatial.native.loading.busy", waiting)
        yield


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Sweep by numpy in the fast part: numba compiles for a minute, and `spatial/test_compiled.py` compares the two.

    A hook and no fixture: fixtures of a module are made before those of a test.
    """
    with pytest.MonkeyPatch.context() as patch:
        if item.get_closest_marker("slow") is None:
            patch.setattr(jointed, "kernel", lambda: None)
            patch.setattr(guided, "fast", lambda _: None)
        return (yield)


@pytest.fixture(scope="session")
def golden() -> list[dict[str, Any]]:
    """Return the golden mechanisms: placed pivots and, from 50- and 60-digit arithmetic, what belongs to them.

    Lengths are as placed; `kappa`, `kappa_star`, `s` are times rho0 and `k`, `k_star` by scale^2.  `undulation`,
    `cuspidation`: a point, ``circle`` (all of it) or ``none``.  `pairs` are the principal pairs besides the driving
    ones and `known` says whether they are ``all``, ``some``, a ``double`` one, or ``undetermined``.  `displaced`: angle
    of the coupler [rad] and displacement (x, y) of the coupler point that was at the pole.
    """
    cases: list[dict[str, Any]] = json.loads(GOLDEN.read_text("utf-8"))
    return cases


@pytest.fixture(scope="session")
def naive() -> SimpleNamespace:
    """Return the slow and obvious ways of `naive.py`."""
    return SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("naive.py"))))


#: Series in the database of the tests.
STORED = ("I.GG", "II.ooo", "II.xy", "II*.xy", "IV.l", "IV*.l")


@pytest.fixture(scope="session")
def small_db(once: Callable[..., Path]) -> Path:
    """Return a database with a block or two of a few series, built once for all workers; do not write to it."""

    def build(path: Path) -> None:
        with catalogue.open(path, build=False) as opened:
            opened.build(count=4000, series=STORED, processes=2)

    return once("small.db", build)


@pytest.fixture(scope="session")
def small(small_db: Path) -> Iterator[catalogue.Catalogue]:
    """Return the catalogue of `small_db`."""
    with catalogue.open(small_db, build=False) as opened:
        yield opened


@pytest.fixture(scope="session")
def answers(once: Callable[..., Path]) -> Callable[[tuple[Any, ...], Callable[[], Any]], Any]:
    """Return a keeper of answers for all workers: of a question that was asked before, else of the function."""
    kept: dict[str, Any] = {}

    def answer(question: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        with np.printoptions(floatmode="unique", threshold=10**6):
            key = re.sub(r"(\d)\.0\b", r"\1", repr(question))  # 3 and 3.0 are one number
        if key not in kept:
            name = f"answer-{sha256(key.encode()).hexdigest()}"
            path = once(name, lambda path: path.write_bytes(pickle.dumps(make())))
            kept[key] = pickle.loads(path.read_bytes())
        return kept[key]

    return answer


#: Of a search for tests of what becomes of its answers, not of how good they are.
BRIEF = Budget(
    per_kind=25, raced=60, rounds=8, leaders=8, tried=12, kept=8, farther=3, broad=1, hops=2, hopped=15, landed=5
)


def _briefly() -> Iterator[None]:
    """Let searches in this process take a third of their time; their answers meet what was asked as all do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Search, "__init__", partialmethod(Search.__init__, budget=BRIEF))
        yield


@pytest.fixture
def in_full(monkeypatch: pytest.MonkeyPatch, *, begin: Callable[..., None] = Search.__init__) -> None:
    """Search in full, where a module searches briefly."""
    monkeypatch.setattr(Search, "__init__", begin)


brief = pytest.fixture(name="brief")(_briefly)
brief_module = pytest.fixture(scope="module", name="brief_module")(_briefly)


@pytest.fixture
def searched_once(answers: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let each problem be searched once in the whole run, for `Catalogue.find`, for dwells or for advice.

    Problems are what becomes of a request and its options: if an option does not arrive the problem is another one, and
    is searched.  For tests of what comes before the search and after it.
    """
    plain, prescribed, advice = find.searched, prescribed_pivots.with_prescribed_pivots, Explanation.advice
    standing = dwells.find_dwells

    def reported(question: tuple[Any, ...], report: SearchReport, make: Callable[[], Any]) -> Any:
        found, told = answers(question, lambda: (make(), vars(report).copy()))
        vars(report).update(told)
        return found

    def searched(database: Any, problem: Any, report: SearchReport, options: find.SearchOptions) -> Any:
        if options.given is not None:
            raise AssertionError("a search with starts is not that of its problem alone")
        question = ("searched", database.path, problem, options)
        return reported(question, report, lambda: plain(database, problem, report, options))

    def given(series: Any, problem: Any, report: SearchReport) -> Any:
        return reported(("given", sorted(series), problem), report, lambda: prescribed(series, problem, report))

    def advised(told: Explanation) -> Advice:
        found: Advice = answers(("advice", told.database.path, told.problem), lambda: advice(told))
        return found

    def dwelling(database: Any, *wish: Any, **options: Any) -> Any:
        question = ("dwells", database.path, wish, sorted(options.items()))
        return answers(question, lambda: standing(database, *wish, **options))

    monkeypatch.setattr(find, "searched", searched)
    monkeypatch.setattr(dwells, "find_dwells", dwelling)
    monkeypatch.setattr(prescribed_pivots, "with_prescribed_pivots", given)
    monkeypatch.setattr(Explanation, "advice", advised)


@pytest.fixture(scope="session")
def random_linkages() -> Callable[..., Linkage]:
    """Return a maker of n random linkages of a family, of size about 1."""

    def make(family: str, n: int, seed: int) -> Linkage:
        draw = np.random.default_rng(seed)
        kinds = FAMILIES[family]
        parts: list[Array] = []
        while sum(map(len, parts)) < n:
            pivots = np.ones((2 * n, 2, 2, 3))
            pivots[..., :2] = draw.normal(size=(2 * n, 2, 2, 2))
            for i, kind in enumerate(kinds):
                if kind != RR:
                    pivots[:, i, 0 if kind == PR else 1, 2] = 0
            linkage, _ = Linkage.valid(pivots)
            ray, z = linkage.rays, linkage.points
            clear = np.abs((ray[:, 0].conj() * ray[:, 1]).imag) > 0.1
            for i, kind in enumerate(kinds):
                if kind == RR:
                    clear &= np.abs(z[:, i, 0] - z[:, i, 1]) > 0.1
            parts.append(linkage.pivots[clear])
        return Linkage(np.concatenate(parts)[:n])

    return make


Pose = tuple[Any, Any]


@pytest.fixture(scope="session")
def follow() -> Callable[..., Pose]:
    """Return a follower of one linkage: (d, turn) with z -> d + turn z, by Newton on the bare constraints in 50 digits.

    The motion is followed from the reference position to the parameter t = tan(angle/2), of the coupler's angle or of
    that of the crank of dyad `crank`, in steps so short that no other branch is near.
    """

    def run(pivots: Array, t: float, crank: int | None = None) -> Pose:
        with mp.workdps(50):
            dyads = [_Dyad(pair) for pair in pivots]
            size = max(abs(z) for dyad in dyads for z in (dyad.fixed, dyad.moving))
            d, angle, done, step = mp.mpc(0), mp.mpf(0), mp.mpf(0), mp.mpf(1) / 16
            while done < 1:
                given = 2 * mp.atan(mp.mpf(float(t)) * min(1, done + step))
                if crank is None:
                    new = _meet(dyads, d, given), given
                else:
                    driver, other = dyads[crank], dyads[1 - crank]
                    target = driver.fixed + mp.expj(given) * (driver.moving - driver.fixed)
                    new = _turn(other, target, driver.moving, angle)
                if abs(new[1] - angle) > 0.2 or abs(new[0] - d) > 0.2 * size:
                    step /= 2
                    continue
                (d, angle), done = new, done + step
            return d, mp.expj(angle)

    return run


class _Dyad:
    """Gap of one dyad and its derivatives, written out case by case."""

    def __init__(self, pair: Array) -> None:
        (x, y, w), (x_star, y_star, w_star) = ([mp.mpf(float(v)) for v in pivot] for pivot in pair)
        self.fixed, self.moving = mp.mpc(x, y), mp.mpc(x_star, y_star)
        self.kind = RR if w and w_star else PR if w_star else RP

    def gap(self, d: Any, angle: Any) -> tuple[Any, Any, Any]:
        """Return the gap, its gradient in d and its derivative in the angle."""
        turn = mp.expj(angle)
        if self.kind == RP:
            normal = turn * self.moving
            arm = self.fixed - d
            value = (mp.conj(normal) * arm).real - (mp.conj(self.moving) * self.fixed).real
            return value, -normal, (mp.conj(1j * normal) * arm).real
        at = d + turn * self.moving
        if self.kind == PR:
            value = (mp.conj(self.fixed) * (at - self.moving)).real
            return value, self.fixed, (mp.conj(self.fixed) * 1j * turn * self.moving).real
        arm = at - self.fixed
        value = abs(arm) ** 2 - abs(self.moving - self.fixed) ** 2
        return value, 2 * arm, 2 * (mp.conj(arm) * 1j * turn * self.moving).real


def _meet(dyads: list[_Dyad], d: Any, angle: Any) -> Any:
    for _ in range(60):
        (f, p, _), (g, q, _) = (dyad.gap(d, angle) for dyad in dyads)
        step = 1j * (g * p - f * q) / (mp.conj(p) * q).imag
        d -= step
        if abs(step) < mp.mpf(10) ** -45:
            return d
    raise ArithmeticError("the loop does not close")


def _turn(other: _Dyad, target: Any, moving: Any, angle: Any) -> tuple[Any, Any]:
    for _ in range(60):
        turn = mp.expj(angle)
        d = target - turn * moving
        value, gradient, slope = other.gap(d, angle)
        step = value / (slope - (mp.conj(gradient) * 1j * turn * moving).real)
        angle -= step
        if abs(step) < mp.mpf(10) ** -45:
            return target - mp.expj(angle) * moving, angle
    raise ArithmeticError("the loop does not close")


@pytest.fixture(scope="session")
def at_revision() -> Callable[[Path, str], Path]:
    """Return a maker of empty database files as they were at a revision."""

    def make(path: Path, revision: str) -> Path:
        path.touch()
        config = Config()
        config.set_main_option("script_location", str(folder("migrations")))
        engine = engine_for(path)
        with engine.connect() as opened:
            opened.connection.cursor().execute("PRAGMA foreign_keys = OFF")  # as for any upgrade
            opened.begin()
            config.attributes.update(connection=opened, metadata=Base.metadata)
            command.upgrade(config, revision)
            opened.commit()
        engine.dispose()
        return path

    return make
