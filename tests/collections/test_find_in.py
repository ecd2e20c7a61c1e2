"""Answers from a collection: within the bounds, measured at the stroke, ranked, explained."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import pytest

import catalogue
from catalogue import Catalogue, CircularArc, InvalidRequest, PluginError, StraightLine
from catalogue.cli import units
from catalogue.collections.bounds import parsed
from catalogue.collections.spec import Collection
from catalogue.find import specimens
from catalogue.find.answers import recall
from catalogue.find.specimens import CollectionResults, checked
from catalogue.problem.path import PathRequest
from catalogue.store import Database

LINE = StraightLine(200, 4)


def not_asked(*_: Any, **__: Any) -> Any:
    raise AssertionError("this collection is made of no four-bars")


def find_in(database: Database, collection: Collection, request: PathRequest, limit: int = 12) -> CollectionResults:
    """Return what a collection answers that no plugin provides."""
    return specimens.find_in(
        database, collection, request, limit=limit, rank_by="deviation", families=(), series=(), where=None,
        special=(), refine=False, drawn=lambda: None, find=not_asked,
    )  # fmt: skip


@pytest.mark.slow
def test_answers_keep_what_was_asked_for(swings: Catalogue) -> None:
    found = swings.find_in("swings", LINE, where={"swing": (16, None), "size": (None, 720.0)}, limit=1000)
    assert 20 < len(found) <= 1000
    for p in found:
        assert p.stroke == 200
        assert p.deviation <= 4
        assert p.radius is None
        assert p.metrics["swing"] >= 16
        assert p.metrics["size"] <= 720
        if p.family == "pendulum":  # in closed form
            half = math.radians(p.metrics["swing"] / 2)
            assert p.metrics["size"] == pytest.approx(100 / math.sin(half), rel=1e-12)
            assert p.deviation == pytest.approx(50 * math.tan(half / 2), rel=1e-9)
    assert [p.deviation for p in found] == sorted(p.deviation for p in found)
    assert {p.family for p in found} == {"pendulum", "roller"}


@pytest.mark.slow
def test_no_better_one_is_missed(swings: Catalogue) -> None:
    every = swings.find_in("swings", StraightLine(1, 0.1), limit=2000)
    best = swings.find_in("swings", StraightLine(1, 0.1), limit=3, rank_by="swing")
    assert len(every) > 300
    assert [p.id for p in best] == [p.id for p in sorted(every, key=lambda p: -p.metrics["swing"])][:3]
    small = swings.find_in("swings", StraightLine(1, 0.1), limit=3, rank_by="size")
    assert [p.id for p in small] == [p.id for p in sorted(every, key=lambda p: p.metrics["size"])][:3]


@pytest.mark.slow
@pytest.mark.parametrize("metric", ["size", "swing"])
def test_a_bound_leaves_out_only_what_breaks_it(swings: Catalogue, metric: str) -> None:
    """Bounds are numbers of answers, which are within them."""
    every = swings.find_in("swings", LINE, limit=2000)
    ordered = sorted(p.metrics[metric] for p in every)
    for low, high in ((ordered[20], ordered[-20]), (None, ordered[40]), (ordered[-40], None)):
        within = (-math.inf if low is None else low), (math.inf if high is None else high)
        found = swings.find_in("swings", LINE, where={metric: (low, high)}, limit=2000)
        assert {p.id for p in found} == {p.id for p in every if within[0] <= p.metrics[metric] <= within[1]}


def test_the_stroke_only_scales(swings: Catalogue) -> None:
    one = swings.find_in("swings", StraightLine(1, 0.02), limit=5)
    far = swings.find_in("swings", StraightLine(1e4, 200), limit=5)
    assert [p.id for p in one] == [p.id for p in far]
    for a, b in zip(one, far, strict=True):
        assert b.deviation == pytest.approx(1e4 * a.deviation)
        assert b.metrics["size"] == pytest.approx(1e4 * a.metrics["size"])
        assert b.metrics["swing"] == pytest.approx(a.metrics["swing"])


def test_names_narrow_and_special_cases_are_said(swings: Catalogue) -> None:
    found = swings.find_in("swings", StraightLine(1, 0.05), families="pendulum", limit=300)
    assert {p.family for p in found} == {"pendulum"}
    assert {p.special for p in found} == {(), ("seconds",)}
    assert {p.family for p in swings.find_in("swings", LINE, series=["curtate"])} == {"roller"}


@pytest.mark.slow
def test_a_given_radius_is_kept(swings: Catalogue) -> None:
    found = swings.find_in("swings", CircularArc(100, 0.3, 250), limit=1000)
    assert found
    for p in found:
        assert p.radius == 250
        assert 0 < p.deviation <= 0.3
        half = math.radians(p.metrics["swing"] / 2)
        bar, rise = p.metrics["size"], 250 - math.sqrt(250**2 - 50**2)
        assert p.deviation == pytest.approx(abs(bar * (1 - math.cos(half)) - rise) / 2, rel=0.05, abs=1e-4)
    everything = swings.find_in("swings", CircularArc(100, 0.3), limit=2000)
    assert all(p.deviation < 1e-12 and p.radius == pytest.approx(p.metrics["size"]) for p in everything)
    near = [p for p in everything if abs(p.metrics["size"] - 250) < 5]  # that the narrowing does not lose
    assert {p.id for p in near} <= {p.id for p in found}


def test_a_piece_that_is_measured_from_another_radius_is_refused(swings: Catalogue) -> None:
    """A plugin that looks for the best radius whatever is asked for: 250 is not what its deviation is from."""
    collection = swings.registry.collection("swings")

    def free(parameters: Any, request: Any) -> Any:
        return collection.measure(parameters, CircularArc(request.stroke, request.deviation))

    heedless = replace(collection, measure=free)
    found = find_in(swings.database, heedless, CircularArc(100, 0.3, 250), limit=1000)
    assert not len(found)
    assert "radius 250" in found.explain()
    assert len(find_in(swings.database, heedless, CircularArc(100, 0.3), limit=5)) == 5


def test_to_pandas_and_json(swings: Catalogue) -> None:
    found = swings.find_in("swings", LINE, limit=4)
    table, rows = found.to_pandas(), json.loads(found.to_json())
    assert list(table.columns) == found.columns == list(rows[0])
    assert table["id"].tolist() == [p.id for p in found] == [r["id"] for r in rows]
    assert table["size"].tolist() == [p.metrics["size"] for p in found]
    assert rows[0]["parameters"]["kind"] == found[0].family
    assert list(found[:2]) == found.candidates[:2]
    assert swings.find_in("swings", StraightLine(1, 1e-9)).to_pandas().columns.tolist() == found.columns


@pytest.mark.slow
def test_explanations(swings: Catalogue) -> None:
    found = swings.find_in("swings", LINE, where={"swing": (40, None)}, limit=2)
    told = found.explain()
    assert "specimens guide a point along a line" in told
    assert "swing >= 40 alone excludes" in told
    assert "2 are shown" in told
    empty = swings.find_in("swings", LINE, where={"size": (None, 10.0)}).explain()
    assert "no piece found: relax size <= 10, which alone excludes" in empty
    nearest = min(p.metrics["size"] for p in swings.find_in("swings", LINE, limit=2000))
    assert f"the nearest has {nearest:.4g}" in empty
    most = swings.find_in("swings", LINE, where={"swing": (170, None)}).explain()
    best = max(p.metrics["swing"] for p in swings.find_in("swings", LINE, limit=2000))
    assert "relax swing >= 170, which alone excludes" in most
    assert f"the nearest has {best:.4g}" in most
    exact = swings.find_in("swings", StraightLine(1, 1e-7)).explain()
    assert "relax deviation 1e-07" in exact
    both = swings.find_in("swings", LINE, where={"swing": (170, None), "size": (None, 1.0)}).explain()
    assert "exclude one another" in both
    nothing = swings.find_in("swings", CircularArc(1, 0.01), families=["roller"]).explain()
    assert "relax family" in nothing


@pytest.mark.slow
def test_what_fails_on_the_finite_motion_is_not_shown(swings: Catalogue) -> None:
    """Though its stored numbers are fine."""
    collection = swings.registry.collection("swings")

    def worse(parameters: Any, request: Any) -> Any:
        found = collection.measure(parameters, request)
        return [replace(m, deviation=m.deviation + 2) for m in found]

    found = find_in(swings.database, replace(collection, measure=worse), LINE, limit=1000)
    assert found
    assert all(2 < p.deviation <= 4 for p in found)
    none = find_in(swings.database, replace(collection, measure=worse), StraightLine(200, 1))
    assert not none
    assert "failed on the finite motion; the nearest has 2." in none.explain()
    told = re.search(r"which (\d+) of (\d+) failed", none.explain())
    assert told is not None
    assert told[1] == told[2] != "0"
    assert f"deviation 1 removed {told[1]}" in none.explain()

    def shorter(parameters: Any, request: Any) -> Any:
        return collection.measure(parameters, request)[1:]

    with pytest.raises(PluginError, match="31 of 32 mechanisms were measured"):
        find_in(swings.database, replace(collection, measure=shorter), LINE)

    def raising(parameters: Any, request: Any) -> Any:
        raise RuntimeError(f"no {request} with {len(parameters)}")

    with pytest.raises(PluginError, match="swings cannot be measured: RuntimeError: no StraightLine"):
        find_in(swings.database, replace(collection, measure=raising), LINE)


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"limit": 0}, "limit must be at least 1"),
        ({"rank_by": "beauty"}, "cannot rank by 'beauty'; swings has deviation, size, swing, sweep"),
        ({"families": ["gears"]}, "there is no family 'gears'; there are pendulum, roller"),
        ({"series": "x"}, "there is no series 'x'; there are simple, curtate"),
        ({"where": {"beauty": (1, None)}}, "swings has no metric 'beauty'; it has size, swing, sweep"),
        ({"where": {"size": 3}}, "size must be bounded by two numbers"),
        ({"where": {"size": ("a", None)}}, "size must be bounded by two numbers"),
        ({"where": {"size": (3, 2)}}, "size cannot be at least 3 and at most 2"),
        ({"where": {"size": (math.nan, None)}}, "size cannot be at least nan"),
    ],
)
def test_a_wish_that_cannot_be_meant(swings: Catalogue, wish: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message.replace("(", r"\(")):
        swings.find_in("swings", LINE, **wish)


@pytest.mark.slow
@pytest.mark.parametrize(
    "wish", [{"where": {"beauty": (1, 2)}}, {"rank_by": "beauty"}, {"limit": 0}, {"families": "x"}]
)
def test_what_cannot_be_meant_is_refused_before_anything_is_drawn(
    make: Callable[..., Catalogue], monkeypatch: pytest.MonkeyPatch, wish: dict[str, Any]
) -> None:
    monkeypatch.setattr(Catalogue, "build_collection", lambda *_, **__: pytest.fail("it was drawn"))
    with make() as opened, pytest.raises(InvalidRequest):
        opened.find_in("swings", StraightLine(1, 0.01), **wish)


def test_a_wish_that_is_none(swings: Catalogue) -> None:
    with pytest.raises(InvalidRequest, match="find_in wants a StraightLine or CircularArc, not 3"):
        swings.find_in("swings", 3)  # type: ignore[arg-type]  # wrong on purpose


def test_conditions_in_words() -> None:
    assert parsed(["size<=3", " swing >= 20 ", "size>=1e0"]) == {"size": (1.0, 3.0), "swing": (20.0, None)}
    for text in ("size", "size<3", "size=3", "size<=x", "<=3", ""):
        with pytest.raises(InvalidRequest, match="--where takes a condition such as"):
            parsed([text])
    with pytest.raises(InvalidRequest, match="--where bounds size <= twice"):
        parsed(["size<=3", "size<=4"])


# -- the command ------------------------------------------------------------------------------------------------------
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def run(dropin: Path) -> Run:
    """Return the command as a process that knows the drop-in."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("CATALOGUE_")}
    root = str(Path(catalogue.__file__).parents[1])
    environment = {**kept, "PYTHONPATH": root, "CATALOGUE_PLUGINS": str(dropin), "COLUMNS": "120", "NO_COLOR": "1"}

    def call(*arguments: Any) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [sys.executable, "-m", "catalogue", *map(str, arguments)],
            env=environment, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert "Traceback" not in done.stderr
        told = [line for line in done.stderr.splitlines(keepends=True) if not line.endswith(" ...\n")]  # how far it is
        return subprocess.CompletedProcess(done.args, done.returncode, done.stdout, "".join(told))

    return call


WISH = ("find", "straight-line", "--stroke", 200, "--deviation", 4, "--collection", "swings")


@pytest.mark.slow
def test_the_command_answers_like_the_library(run: Run, swings_db: Path, swings: Catalogue) -> None:
    options = ("--where", "swing>=20", "--where", "size<=400", "--family", "roller", "--rank-by", "size", "--limit", 3)
    same = swings.find_in(
        "swings", LINE, where={"swing": (20, None), "size": (None, 400)}, families=["roller"], rank_by="size", limit=3
    )
    done = run(*WISH, *options, "--format", "json", "--db", swings_db)
    assert (done.returncode, done.stderr) == (0, "")
    printed = json.loads(done.stdout)
    assert all(row.pop("code") for row in printed)
    assert printed == json.loads(same.to_json())
    rows = list(csv.DictReader(io.StringIO(run(*WISH, *options, "--format", "csv", "--db", swings_db).stdout)))
    assert list(rows[0]) == ["code", *same.columns]
    assert [float(r["size"]) for r in rows] == [p.metrics["size"] for p in same]
    table = run(*WISH, *options, "--db", swings_db).stdout
    assert "Things that swing, a straight line of 200" in table
    assert "swing: angle of the motion [deg]" in table


@pytest.mark.slow
def test_the_first_use_draws_the_specimens(run: Run, tmp_path: Path) -> None:
    file, drawing = tmp_path / "new.db", tmp_path / "best.svg"
    first = run(*WISH, "--limit", 1, "--format", "json", "--plot", drawing, "--explain", "--db", file)
    assert first.returncode == 0
    assert "drawing swings: 3" in first.stderr
    assert "1 are shown" in first.stderr
    assert drawing.stat().st_size > 3000
    again = run(*WISH, "--limit", 1, "--format", "json", "--db", file)
    assert (again.stdout, again.stderr) == (first.stdout, "")
    told = run("plugins", "--format", "json", "--db", file)
    (record,) = [r for r in json.loads(told.stdout) if r["name"] == "swings"]
    assert record["collections"] == ["swings"]
    assert record["specimens"]["swings"] >= 3000
    assert "nothing to do: 3" in run("build", "--collection", "swings", "--db", file).stderr
    assert "drawing swings" in run("build", "--collection", "swings", "--count", 4500, "--db", file).stderr
    assert run(*WISH, "--limit", 1, "--format", "json", "--db", file).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ((*WISH, "--where", "size<=1"), 1, "catalogue: no piece found: relax size <= 1"),
        ((*WISH, "--where", "size=1"), 2, "--where takes a condition"),
        ((*WISH, "--max-size", 1), 1, "catalogue: no piece found: relax size <= 1"),
        ((*WISH, "--where", "size<=2", "--max-size", 1), 1, "catalogue: no piece found: relax size <= 1"),
        ((*WISH, "--min-link", 3), 2, "min_link does not go with swings, which measures "),
        ((*WISH, "--order", 3), 2, "--order does not go with --collection, which knows --where, --family"),
        ((*WISH, "--pins-only"), 2, "pins_only does not go with swings: the kinds of its joints are not known"),
        ((*WISH, "--along", 30), 2, "swings lays its paths from the origin along +x"),
        ((*WISH[:-1], "gears"), 5, "no plugin provides the collection gears"),
        ((*WISH[:-2], "--where", "size<=1"), 2, "--where bounds a metric of a collection: name it with --collection"),
        (("build", "--collection", "swings", "--series", "x"), 2, "--series, --processes and --engine do not go with"),
        (("build", "--collection", "swings", "--count", 0), 2, "count must be at least 1, not 0"),
    ],
)
def test_what_cannot_be_answered_is_one_line(
    run: Run, swings_db: Path, options: tuple[Any, ...], code: int, message: str
) -> None:
    done = run(*options, "--db", swings_db)
    assert done.returncode == code
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""


@pytest.mark.slow
def test_plugins_lists_collections_without_a_database(run: Run, tmp_path: Path) -> None:
    done = run("plugins", "--db", tmp_path / "none.db")
    assert done.returncode == 0
    assert "swings (0 specimens)" in done.stdout.replace("\n", " ")
    assert not (tmp_path / "none.db").exists()


def test_an_answer_that_says_what_it_is_not_is_refused(swings: Catalogue) -> None:
    (found,) = swings.find_in("swings", LINE, limit=1)
    checked(found)
    many: list[dict[str, Any]] = [{"series": "none"}, {"deviation": 1.1 * found.deviation}]
    many += [{"metrics": {name: 1.1 * value + 1}} for name, value in found.metrics.items()]
    assert len(many) > 2
    for wrong in many:
        with pytest.raises(InvalidRequest):
            checked(replace(found, **wrong))
    assert checked(replace(found, metrics={})).metrics == pytest.approx(found.metrics), "one kept without metrics"


def test_a_collection_changes_nothing_of_what_it_is_given(swings: Catalogue) -> None:
    """What a function does to the parameters that it is given is done to a copy."""
    sound = swings.find_in("swings", LINE, limit=3)
    own = swings.registry.collection("swings")

    def spoilt(function: Any) -> Any:
        def spoils(first: Any, *rest: Any) -> Any:
            answer = function(first, *rest)
            for one in first if isinstance(first, list) else [first]:
                (one if isinstance(one, dict) else one.parameters).clear()
            return answer

        return spoils

    bad = replace(own, **{name: spoilt(getattr(own, name)) for name in ("measure", "classify", "plot")})
    found = find_in(swings.database, bad, LINE, limit=3)
    found[0].plot()
    assert [one.to_dict() for one in found] == [one.to_dict() for one in sound]


def test_an_answer_keeps_its_unit_and_is_laid_anew_in_another(swings: Catalogue) -> None:
    inches = swings.find_in("swings", StraightLine(14, 0.3, unit="in"), limit=5)
    metric = swings.find_in("swings", StraightLine(355.6, 7.62, unit="mm"), limit=5)
    assert {one.unit for one in inches} == {"in"}
    for one, other in zip(inches, metric, strict=True):
        moved = specimens.in_unit(one, "mm")
        assert (moved.unit, moved.stroke, moved.id) == ("mm", 355.6, other.id)
        assert moved.deviation == pytest.approx(other.deviation, rel=1e-9)
        assert moved.metrics == pytest.approx(other.metrics, rel=1e-9)
        assert specimens.in_unit(replace(one, unit=None), "mm").metrics == one.metrics
    (code,) = inches[:1].remember()
    assert recall(code, swings.registry.collection).unit == "in"
    with click.Context(click.Command("show")) as ctx:
        ctx.meta[units.KEY] = "mm"
        assert units.in_output_unit(inches)[0].metrics == specimens.in_unit(inches[0], "mm").metrics
    assert [one["unit"] for one in json.loads(inches.to_json())] == ["in"] * 5
