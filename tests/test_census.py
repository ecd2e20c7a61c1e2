"""The census: what is stored, cell by cell, counted again by hand, and why a cell is empty."""

from __future__ import annotations

import sqlite3
from collections import Counter
from contextlib import closing
from pathlib import Path

import pytest
from click.testing import CliRunner

from catalogue import Catalogue
from catalogue.cli.census import census as census_command
from catalogue.find.census import ALLIEVI_COUNT, LETTER_COUNT, NORMAL, Cell, _why, census, impossible
from catalogue.plugin.registry import Registry
from catalogue.series.named_guides import named_guides

STORED = ("I.GG", "II.ooo", "II.xy", "II*.xy", "IV.l", "IV*.l")  # in the small database


@pytest.fixture(scope="module")
def cells(small: Catalogue) -> list[Cell]:
    return census(small.database, small.registry)


def test_counts_are_those_of_the_tables(cells: list[Cell], small_db: Path) -> None:
    with closing(sqlite3.connect(small_db)) as connection:
        rows = connection.execute(
            "SELECT m.series, m.family, m.configuration, m.id, g.id FROM mechanism m JOIN guide g"
            " ON g.mechanism_id = m.id WHERE m.batch_id IS NOT NULL"
        ).fetchall()
        best = connection.execute(
            "SELECT m.series, m.family, m.configuration, r.level, min(r.size) FROM mechanism m"
            " JOIN guide g ON g.mechanism_id = m.id JOIN reach r ON r.guide_id = g.id"
            " WHERE m.batch_id IS NOT NULL GROUP BY 1, 2, 3, 4"
        ).fetchall()
    guides = Counter(row[:3] for row in rows)
    mechanisms = Counter(row[:3] for row in {row[:4] for row in rows})
    counted = {(c.series, c.family, c.configuration): c for c in cells}
    assert {k for k, c in counted.items() if c.guides} == set(guides)
    for key, cell in counted.items():
        assert (cell.guides, cell.mechanisms) == (guides[key], mechanisms[key])
        assert bool(cell.remark) == (not cell.guides)
    for *key, level, size in best:
        assert counted[tuple(key)].smallest[level] == size


@pytest.mark.slow
def test_guides_and_named_guides_together_are_all_that_is_stored(cells: list[Cell], small_db: Path) -> None:
    with closing(sqlite3.connect(small_db)) as connection:
        (guides,) = connection.execute("SELECT count(*) FROM guide").fetchone()
        (mechanisms,) = connection.execute("SELECT count(*) FROM mechanism").fetchone()
    named = sum(c.named for c in cells)
    assert named == len(named_guides())
    assert sum(c.guides for c in cells) + named == guides
    assert sum(c.mechanisms for c in cells) + named == mechanisms


@pytest.mark.slow
def test_the_command_says_that_named_guides_are_counted_apart(small_db: Path) -> None:
    done = CliRunner().invoke(census_command, ["--db", str(small_db)])
    told = " ".join(done.output.split())
    with closing(sqlite3.connect(small_db)) as connection:
        (guides,) = connection.execute("SELECT count(*) FROM guide").fetchone()
    assert f"with {len(named_guides())} named guides apart" in told
    assert f"{guides} guides are stored" in told


def test_every_series_has_its_cells(cells: list[Cell]) -> None:
    assert {c.series for c in cells} == set(Registry().series)
    of = {c.configuration for c in cells if c.series == "I.GG"}
    assert of == {"PP", "XX", "NN"}  # both pivots of a crank on one side of the pole, as those of the other
    general = {(c.family, c.configuration) for c in cells if c.series == "general"}
    assert general >= {("four-bar", one) for one in NORMAL["four-bar"]}


def test_an_empty_cell_says_why(cells: list[Cell]) -> None:
    remarks = {(c.series, c.family): c.remark for c in cells if not c.guides}
    assert remarks["I.yy", "swinging-block"].startswith("impossible")
    assert remarks["III.KK", "four-bar"] == "not built: `catalogue build --series III.KK`"
    assert not [c for c in cells if c.remark and c.series in STORED]


def test_why_a_cell_is_empty() -> None:
    assert _why(0, 0, 0) == "not reached by the domain of any member"
    assert _why(9, 0, 9) == "none of 9 drawn is in proportion"
    assert _why(9, 4, 9) == "4 of 9 drawn are in proportion, none holds a usable guide"


def test_dimensions_are_those_of_the_theory(cells: list[Cell]) -> None:
    """Modulo similarity: a four-bar 4, a slider-crank 3; a degeneration takes one or two away."""
    dimension = {(c.series, c.family): c.dimension for c in cells}
    expected = {("general", "four-bar"): 4, ("general", "slider-crank"): 3, ("general", "swinging-block"): 2,
                ("I.GG", "four-bar"): 3, ("II.xy", "four-bar"): 2, ("III.KK", "four-bar"): 3,
                ("II.ooo", "elliptic-trammel"): 2, ("IV*.l", "four-bar"): 2, ("parallel", "four-bar"): 3}  # fmt: skip
    assert {k: dimension[k] for k in expected} == expected


def test_impossible_configurations_are_named(cells: list[Cell], small: Catalogue) -> None:
    assert impossible(small.registry.series["I.GG"], cells) == [
        ("four-bar", "PX"), ("four-bar", "PN"), ("four-bar", "XN")
    ]  # fmt: skip
    assert impossible(small.registry.series["general"], cells) == []
    assert (ALLIEVI_COUNT, LETTER_COUNT) == (54, 48)
