"""Specimens are drawn once, in blocks, the same for the same seed, and go on where they were interrupted."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, InvalidRequest, PluginError
from catalogue.collections.spec import Collection, Specimen
from catalogue.populate.collect import COLLECTING, collect, is_current, state, stored

pytestmark = pytest.mark.slow

Make = Callable[..., Catalogue]


def content(cat: Catalogue) -> list[Any]:
    query = (
        "SELECT collection, family, series, configuration, kind, block, deviation, parameters, metrics FROM specimens"
    )
    with closing(sqlite3.connect(cat.database.path)) as connection:
        return connection.execute(query + " ORDER BY collection, family, block, id").fetchall()


@pytest.fixture
def swings(make: Make) -> Collection:
    """Return the collection."""
    with make("other") as cat:
        return cat.registry.collection("swings")


def test_a_block_of_one_specimen_is_stored(make: Make, swings: Collection) -> None:
    one = replace(swings, draw=lambda family, rng, _: swings.draw(family, rng, 1)[:1])
    with make() as cat:
        done = collect(cat.database, one, "1.0", count=4)
        assert done.rows == len(content(cat)) >= 4


def test_same_seed_and_count_same_content(make: Make) -> None:
    with make("one") as one, make("other") as other, make("third") as third:
        for cat, seed in ((one, 3), (other, 3), (third, 4)):
            done = cat.build_collection("swings", count=900, seed=seed)
            assert done.guides == done.rows >= 900
        assert content(one) == content(other)
        assert content(one) != content(third)
        families = stored(one.database, "swings")
        assert families.keys() == {"pendulum", "roller"}
        assert all(number >= 450 for number, _ in families.values())


def test_an_interrupted_build_goes_on(make: Make) -> None:
    class Stop(Exception):
        pass

    def stop(progress: Any) -> None:
        if progress.rows > 192:
            raise Stop

    with make("one") as whole, make("other") as cut:
        whole.build_collection("swings", count=1500)
        with pytest.raises(Stop):
            cut.build_collection("swings", count=1500, report=stop)
        half = content(cut)
        assert 0 < len(half) < len(content(whole))
        assert not state(cut.database, "swings")["complete"]
        cut.build_collection("swings")  # as begun
        assert content(cut) == content(whole)
        assert state(cut.database, "swings")["complete"]
        again = cut.build_collection("swings")
        assert (again.rows, again.guides) == (0, len(content(whole)))


def test_more_adds_and_another_seed_or_plan_replaces(make: Make, swings: Collection) -> None:
    with make() as cat:
        cat.build_collection("swings", count=100)
        few = content(cat)
        cat.build_collection("swings", count=1000)
        more = content(cat)
        assert len(more) > len(few)
        assert [row for row in more if row in few] == few
        cat.build_collection("swings", count=100, seed=9)
        assert not {row[-2] for row in content(cat)} & {row[-2] for row in more}
        before = content(cat)
        assert collect(cat.database, swings, "1.0", count=100).rows == 0
        assert collect(cat.database, replace(swings, plan="2"), "1.0", count=100).rows == len(before)
        assert collect(cat.database, replace(swings, plan="2"), "1.1", count=100).rows == len(before)


def test_what_another_version_drew_is_drawn_again_on_use(make: Make, swings: Collection) -> None:
    with make() as cat:
        assert not is_current(cat.database, swings, "1.0")
        collect(cat.database, swings, "0.9", count=100)
        assert is_current(cat.database, swings, "0.9")
        assert not is_current(cat.database, swings, "1.0")
        assert not is_current(cat.database, replace(swings, plan="2"), "0.9")
        old = content(cat)
        assert cat.find_in("swings", catalogue.StraightLine(1, 0.05), quiet=True)
        assert is_current(cat.database, swings, "1.0")
        assert content(cat) == old  # same seed, same draws


def test_other_collections_are_left_alone(make: Make, swings: Collection) -> None:
    with make() as cat:
        cat.build_collection("swings", count=100)
        collect(cat.database, replace(swings, name="more-swings"), "1.0", count=100)
        collect(cat.database, replace(swings, name="more-swings"), "1.0", count=100, seed=5)
        assert set(stored(cat.database, "swings")) == set(stored(cat.database, "more-swings"))


def test_a_family_that_gives_nothing_comes_to_an_end(make: Make, swings: Collection) -> None:
    asked = []

    def barren(family: str, rng: np.random.Generator, count: int) -> Sequence[Specimen]:
        asked.append(family)
        return swings.draw(family, rng, count) if family == "pendulum" else []

    with make() as cat:
        done = collect(cat.database, replace(swings, draw=barren), "1.0", count=100)
        assert asked.count("roller") == COLLECTING.barren
        assert done.guides == stored(cat.database, "swings")["pendulum"][0]


def test_a_collection_that_raises_or_lies_is_named(make: Make, swings: Collection) -> None:
    def raising(family: str, rng: np.random.Generator, count: int) -> Sequence[Specimen]:
        raise RuntimeError(f"no {family} for {count} with {rng}")

    def lying(family: str, rng: np.random.Generator, count: int) -> Sequence[Specimen]:
        return [replace(s, series="unheard") for s in swings.draw(family, rng, count)]

    with make() as cat:
        with pytest.raises(PluginError, match="swings cannot be drawn: RuntimeError: no pendulum"):
            collect(cat.database, replace(swings, draw=raising), "1.0")
        with pytest.raises(PluginError, match=r"swings cannot be drawn: PluginError: .* pendulum unheard"):
            collect(cat.database, replace(swings, draw=lying), "1.0")
        assert content(cat) == []


def test_two_first_uses_at_once_store_each_specimen_once(make: Make) -> None:
    def report(_: Any) -> None:  # a second process, whenever the first has stored a block
        with make() as second:
            second.build_collection("swings", count=600)

    with make() as cat, make("alone") as alone:
        cat.build_collection("swings", count=600, report=report)
        alone.build_collection("swings", count=600)
        assert content(cat) == content(alone)


def test_drawing_otherwise_meanwhile_is_said(make: Make) -> None:
    def report(_: Any) -> None:
        with make() as second:
            second.build_collection("swings", count=100, seed=9)

    with make() as cat, pytest.raises(catalogue.DatabaseError, match="another process draws swings with another seed"):
        cat.build_collection("swings", count=900, report=report)


@pytest.mark.parametrize("wrong", [{"count": 0}, {"seed": -1}])
def test_impossible_numbers_are_refused(make: Make, wrong: dict[str, Any]) -> None:
    with make() as cat, pytest.raises(InvalidRequest, match=r"^(count|seed) must be at least"):
        cat.build_collection("swings", **wrong)


def test_a_kill_leaves_whole_blocks(swings_db: Path) -> None:
    """Every block that is there is there in full: they are written in one transaction each."""
    with closing(sqlite3.connect(swings_db)) as connection:
        sizes = connection.execute("SELECT family, block, count(*) FROM specimens GROUP BY family, block").fetchall()
    assert {n for family, _, n in sizes if family == "roller"} == {192}
    assert {n for family, _, n in sizes if family == "pendulum"} == {2 * 192}
