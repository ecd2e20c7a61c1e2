"""Named guides: sound data, deviations that theory and textbooks give, their place among the series and in a file."""

from __future__ import annotations

import json
import math
import re
import shlex
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import catalogue
from catalogue.cli import app
from catalogue.curvature_theory.leading_error import EXACT
from catalogue.errors import InvalidDesign, InvalidRequest
from catalogue.find.stored import as_published
from catalogue.guidance.placement import at_stroke
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry
from catalogue.populate.fill import fill
from catalogue.populate.named_guides import MEMBER, UNKNOWN
from catalogue.series.named_guides import NamedGuide, _entries, _made, named_guides
from catalogue.store import Database
from catalogue.testing.contact import contact_order, largest_gap, taylor
from tests.precision import EXTENDED

ALL = named_guides()
#: Series that are there in any case, with designs that belong to them.
PLACES = {
    "watt": "IV*.l", "watt-unequal": "IV*.l", "roberts": "I.GG", "roberts-four-inflections": "I.GG",
    "chebyshev": "I.GG", "allievi-64": "I.GG", "evans": "II.xy", "evans-oblique": "II.xy", "evans-grasshopper": "II.xy",
    "conchoid-two-cranks": "II*.xy", "scott-russell": "II.ooo", "cardan": "II.ooo", "archimedes": "II.ooo",
}  # fmt: skip


@pytest.fixture(params=ALL)
def design(request: pytest.FixtureRequest) -> NamedGuide:
    """Return each design in turn."""
    return ALL[request.param]


def pair(design: NamedGuide) -> Array:
    """Return the guided point with its nominal, as a pair."""
    normal = 1j * design.guide.tangent[0]
    nominal = [*design.centre, 1.0] if design.centre else [normal.real, normal.imag, 0.0]
    return np.array([nominal, [*design.guided, 1.0]])


def measured(name: str, stroke: float) -> float:
    """Return the deviation of a design over another stroke."""
    one = ALL[name]
    return float(at_stroke(one.guide, stroke, circle=one.circle).fit.deviation[0])


# -- data -------------------------------------------------------------------------------------------------------------
def test_each_says_where_it_comes_from_and_names_its_series(design: NamedGuide) -> None:
    assert len(design.source) > 10
    assert any(word in design.place for word in ("eries ", "no longer in ", "No degeneration"))
    assert "\n" not in design.place
    assert design.name == design.name.lower()
    assert 0 < design.share <= 1


def test_order_is_that_of_contact_and_inflections_are_counted(design: NamedGuide) -> None:
    """Merged ones count as often as they merge, the others are changes of sign of the curvature."""
    found = contact_order(taylor(design.linkage.pivots[0], [pair(design)])[0])
    if design.order == EXACT:
        assert found is None
        assert largest_gap(design.linkage.pivots[0], [pair(design)])[0] < 1e-14
        return
    assert found is not None
    assert design.order == found
    if design.circle:
        assert design.inflections == 0
        return
    near, nearer = (
        float(at_stroke(design.guide, part * design.stroke, circle=False, extend=True).fit.deviation[0])
        for part in (0.05, 0.025)
    )
    assert math.log2(near / nearer) == pytest.approx(design.order + 1, abs=0.1)  # what is left grows by that power
    t = design.traced
    share = np.linspace(-1, 1, 400)  # an even number: none at the middle
    u, v = (x[:, 0] for x in design.guide.path.window(t.low.astype(float), t.high.astype(float), share))
    bend = np.gradient(np.gradient(v) / np.gradient(u))[3:-3]
    changes = int((np.diff(np.sign(bend)) != 0).sum())
    merged = found - 1
    assert design.inflections == merged + changes - merged % 2


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"source": "  "}, "source is blank"),
        ({"nominal": "spiral"}, "a line, or a circle with a centre"),
        ({"nominal": "circle"}, "a line, or a circle with a centre"),
        ({"inflections": -1}, "no -1 inflections"),
        ({"family": "oldham"}, "those of a four-bar"),
        ({"stroke": 40.0}, "stroke 40 cannot be traced"),
        ({"pivots": (((0, 0, 1), (0, 0, 1)), ((1, 0, 1), (1, 1, 1)))}, "coincide"),
        ({"pivots": (((0, 0, 1), (0, 1, 1)), ((1, 0, 1), (1, 1, 1)))}, "translates"),
    ],
)
def test_a_design_that_contradicts_itself_is_refused(change: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidDesign, match=text):
        replace(ALL["watt"], **change)


def test_the_canonical_frame_has_the_pole_at_the_origin(design: NamedGuide) -> None:
    linkage, point, _, half = design.canonical()
    at = catalogue.curvature(linkage)
    np.testing.assert_allclose(at.pole[0], 0, atol=1e-13)
    np.testing.assert_allclose(at.axes[0], np.eye(2) if np.isfinite(at.rho0[0]) else at.axes[0], atol=1e-13)
    if np.isfinite(at.rho0[0]):
        np.testing.assert_allclose(at.rho0[0], 1, rtol=1e-13)
    else:
        np.testing.assert_allclose(linkage.points[0, 0].imag, 1, rtol=1e-13)
    scale = half / (0.5 * design.stroke)
    near = np.abs(linkage.points[0][linkage.finite[0]] - point).min()
    assert near == pytest.approx(
        scale * np.abs(design.linkage.points[0][design.linkage.finite[0]] - complex(*design.guided)).min(), abs=1e-13
    )


# -- deviations -------------------------------------------------------------------------------------------------------
def test_watt_lengthened_touches_its_line_at_n_and_bends_at_sqrt_three_fifths_of_it() -> None:
    """Theory of the planar guides, erratum E1: the book has the inflections at n."""
    n, m = 1.5, 5.0
    design = ALL["watt-lengthened"]
    crank = np.abs(design.linkage.points[0, 0, 1] - design.linkage.points[0, 0, 0])
    assert crank == pytest.approx(np.hypot(m, n), rel=1e-14)
    ends = design.traced.low.astype(float), design.traced.high.astype(float)
    path = design.guide.path.window(*ends, np.linspace(-1, 1, 4001))
    z = (path[0] + 1j * path[1])[:, 0] * design.guide.tangent[0]
    x, y = z.real, z.imag  # the guiding line is x = 0
    touch = [np.abs(x[side]).min() for side in (y > 0.8 * n, y < -0.8 * n)]
    assert max(touch) < 1e-2 * np.abs(x).max()
    assert x[y > 0].max() * x[y > 0].min() >= -1e-9 * np.abs(x).max() ** 2  # touched, not crossed
    bend = np.gradient(np.gradient(x, y), y)[5:-5]
    turns = y[5:-5][np.flatnonzero(np.diff(np.sign(bend)))]
    assert len(turns) == 3
    assert np.abs(turns[[0, -1]]) / n == pytest.approx([0.78, 0.78], abs=0.01)


def test_watt_gains_five_times_by_longer_cranks() -> None:
    gain = measured("watt", ALL["watt-lengthened"].stroke) / ALL["watt-lengthened"].deviation
    assert 5.2231 < gain < 6  # the former for a short stroke


@pytest.mark.parametrize(
    ("name", "scale", "stroke", "published"),
    [
        ("watt", 5, 0.4, 2.28e-05),
        ("roberts-four-inflections", 9, 0.2, 5.88e-07),
        ("evans-oblique", 15, 0.2, 1.67e-06),
        ("conchoid", 6, 0.2, 1.88e-07),
        ("conchoid-two-cranks", 6, 0.1, 6.59e-08),
        ("perpendicular-cranks", 1, 0.2, 4.87e-07),
        ("four-inflections", 1, 0.1, 1.89e-07),
        ("four-inflections-slide", 1, 0.2, 1.91e-06),
        ("allievi-82", 1, 0.2, 8.01e-07),
    ],
)
def test_deviations_are_those_of_the_theory(name: str, scale: float, stroke: float, published: float) -> None:
    """Measured at the singular point, in diameters of the inflection circle (Watt: cranks)."""
    assert measured(name, scale * stroke) / scale == pytest.approx(published, rel=6e-3)


@pytest.mark.parametrize(
    ("name", "percent"), [("hoeken-60", 2.655e-4), ("hoeken-180", 0.0963), ("hoeken-180-minimax", 0.08925)]
)
def test_hoeken_holds_the_band_of_the_textbook(name: str, percent: float) -> None:
    design = ALL[name]
    assert 200 * design.deviation / design.stroke == pytest.approx(percent, rel=1e-3)


def test_chebyshev_and_its_cognates_share_one_path() -> None:
    same = [ALL[name] for name in ("chebyshev", "chebyshev-cognate-left", "chebyshev-cognate-right", "hoeken")]
    for stroke in (1.0, 2.5, 4.0):
        found = [measured(one.name, stroke) for one in same]
        assert found == pytest.approx([found[0]] * 4, rel=1e-9)
    assert same[0].deviation / same[0].stroke == pytest.approx(1.219e-3, rel=1e-3)


def test_roberts_meets_the_line_of_its_fixed_pivots_at_both() -> None:
    design = ALL["roberts"]
    t = design.traced
    u, v = design.guide.path.window(t.low.astype(float), t.high.astype(float), np.array([-1.0, 0.0, 1.0]))
    ends = design.guide.point + (u + 1j * v)[:, 0] * design.guide.tangent
    np.testing.assert_allclose(np.sort_complex(ends), [-2, 0, 2], atol=1e-9)


def test_exact_guides_are_exact() -> None:
    for design in ALL.values():
        if design.order == EXACT:
            assert design.deviation < (1e-15 if EXTENDED else 1e-14) * design.stroke


# -- place ------------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_designs_are_classified_by_the_series_that_they_stand_for() -> None:
    for name, code in PLACES.items():
        found = catalogue.classify(ALL[name].linkage)[0]
        assert code in found.series, name
        assert code in ALL[name].place, name


@pytest.fixture(scope="module")
def registry() -> Registry:
    """Return the built-in plugins."""
    return Registry()


# -- in a file --------------------------------------------------------------------------------------------------------
NAMED = (
    "SELECT m.name, m.series, m.member, m.rho0 IS NULL, g.kind, g.contact_order, g.inflections, count(r.level), m.id"
    " FROM mechanism m JOIN guide g ON g.mechanism_id = m.id JOIN reach r ON r.guide_id = g.id"
    " WHERE m.batch_id IS NULL GROUP BY g.id ORDER BY g.id"
)


def rows(path: Path) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(NAMED).fetchall()


@pytest.mark.slow
def test_each_is_in_the_database_with_its_guide_and_reaches(small_db: Path) -> None:
    stored = {str(row[0]): row for row in rows(small_db)}
    assert set(stored) == set(ALL)
    for name, (_, series, member, parallel, kind, order, inflections, levels, _) in stored.items():
        design = ALL[name]
        near = catalogue.classify(design.linkage)[0].nearest
        assert (series, member) == (near.series if near else UNKNOWN, MEMBER)
        assert (kind, order) == (design.nominal, design.order)
        assert inflections == design.inflections
        assert bool(parallel) == name.startswith("watt")
        assert levels


def test_stored_arcs_are_about_the_centres_of_their_designs(small_db: Path) -> None:
    arcs = {name: design for name, design in ALL.items() if design.circle}
    assert len(arcs) > 2
    query = "SELECT g.x, g.y, g.curvature FROM guide g JOIN mechanism m ON m.id = g.mechanism_id WHERE m.name = ?"
    with closing(sqlite3.connect(small_db)) as connection:
        for name, design in arcs.items():
            ((x, y, curvature),) = connection.execute(query, (name,))
            _, point, centre, _ = design.canonical()
            assert complex(x, y) == pytest.approx(point)
            assert 1 / abs(curvature) == pytest.approx(abs(centre - point), rel=1e-9)


@pytest.mark.slow
def test_a_build_of_one_series_holds_them_all_and_a_second_one_leaves_them(tmp_path: Path, registry: Registry) -> None:
    path = tmp_path / "one.db"
    with Database.open(path) as database:
        fill(database, registry, count=10, series=["II.ooo"], processes=1)
        first = rows(path)
        fill(database, registry, count=10, series=["II.ooo"], processes=1)
    assert rows(path) == first
    assert {row[0] for row in first} == set(ALL)


@pytest.mark.slow
def test_a_design_that_changed_is_written_anew(tmp_path: Path, registry: Registry) -> None:
    path = tmp_path / "one.db"
    with Database.open(path) as database:
        fill(database, registry, count=10, series=["II.ooo"], processes=1)
        before = rows(path)
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("PRAGMA foreign_keys = OFF")
            connection.execute("UPDATE guide SET x = x + 1 WHERE id = (SELECT min(id) FROM guide)")
            connection.execute("PRAGMA user_version = 0")  # as of a file without a seal
            connection.commit()
        fill(database, registry, count=10, series=["II.ooo"], processes=1)
    assert sorted(row[:-1] for row in rows(path)) == sorted(row[:-1] for row in before)


@pytest.mark.slow
def test_designs_of_series_that_were_not_built_are_starts_too(tmp_path: Path, registry: Registry) -> None:
    path = tmp_path / "one.db"
    with Database.open(path) as database:
        fill(database, registry, count=300, series=["II.ooo"], processes=1)
    line = catalogue.StraightLine(1.0, 1e-3)
    with catalogue.open(path, build=False) as one:
        assert {g.series for g in one.find(line)} > {"II.ooo"}
        watts = one.find(line, series=["IV*.l"])
        numbers: list[Any] = [g.id for g in watts]
        assert {one.guide(number).name for number in numbers} <= {"watt", "watt-lengthened", "watt-unequal"}
        assert len(watts)


@pytest.mark.slow
def test_a_stored_design_has_its_curvature_and_no_batch(small: catalogue.Catalogue) -> None:
    roberts = small.guide("roberts-four-inflections")
    assert roberts.name == "roberts-four-inflections"
    assert roberts.rho0 == pytest.approx(1)
    assert (roberts.kappa, roberts.kappa_star) == pytest.approx((1, 2))
    assert roberts.provenance == {}
    assert small.guide("watt").kappa is None
    number = small.find(catalogue.StraightLine(1.0, 1e-3), series=["I.GG"], families=["four-bar"])[0].id
    assert number is not None
    drawn = small.guide(number)
    assert drawn.name is not None or set(drawn.provenance) == {"plugin", "plugin_version", "plan", "seed", "number"}


@pytest.mark.slow
def test_a_guide_has_the_reaches_that_are_stored_of_it_be_it_one_alone(small: catalogue.Catalogue) -> None:
    stored = small.database.plain({"guide_id": int, "level": int}, "FROM reach ORDER BY guide_id, level DESC")
    number, first, count = np.unique(stored["guide_id"], return_index=True, return_counts=True)
    assert count.min() == 1
    for many in np.unique(count):
        k = int(np.argmax(count == many))
        guide = small.guide(int(number[k]))
        levels = stored["level"][first[k] : first[k] + many]
        assert sorted(guide.reaches["level"]) == sorted(levels)
        assert guide.at(1.0, int(levels[0])).deviation <= 1.05 * 10.0 ** levels[0]


def test_names_that_are_near_are_named(small: catalogue.Catalogue) -> None:
    with pytest.raises(InvalidRequest, match=r"near names are .*watt"):
        small.guide("wat")
    with pytest.raises(InvalidRequest, match="catalogue find"):
        small.guide("qqqq")


def test_an_old_file_without_them_says_how_to_add_them(tmp_path: Path) -> None:
    with (
        catalogue.open(tmp_path / "old.db", build=False) as old,
        pytest.raises(InvalidRequest, match="catalogue build"),
    ):
        old.guide("watt")


# -- shown ------------------------------------------------------------------------------------------------------------
def shown(small_db: Path, *options: str) -> str:
    found = CliRunner().invoke(app, ["show", *options, "--db", str(small_db)], catch_exceptions=False)
    assert found.exit_code == 0
    return found.stdout


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_show_tells_name_title_source_place_series_and_deviation(small_db: Path) -> None:
    text, design = shown(small_db, "watt"), ALL["watt"]
    assert text.startswith("watt: Watt's linkage\n")
    words = " ".join(text.split())  # lines are broken to fit the terminal
    for part in (design.source, design.place, design.proportions, "series IV*.l (residual 0)", "0.00106"):
        assert part in words


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_show_names_the_nearest_series_if_none_holds(small_db: Path) -> None:
    found = catalogue.classify(ALL["watt-lengthened"].linkage)[0]
    text = shown(small_db, "watt-lengthened")
    if found.series:
        assert found.series[0] in text
    else:
        assert found.nearest is not None
        assert f"the nearest is {found.nearest.series}" in text


@pytest.mark.slow
def test_show_compares_with_the_straightest_held_of_the_series_on_the_same_stroke_and_size(
    small_db: Path, small: catalogue.Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It does not refine, which takes seconds, and names the command that does."""
    with monkeypatch.context() as patch:
        patch.setattr("catalogue.search.search.Refinement", None)
        answer = json.loads(shown(small_db, "watt", "--stroke", "150", "--format", "json"))
        words = shown(small_db, "watt", "--stroke", "150")
    design = ALL["watt"]
    assert answer["deviation"] == pytest.approx(150 * design.deviation / design.stroke, rel=1e-6)
    assert answer["design"]["deviation"] == answer["deviation"]
    best = answer["design"]["best_of_series"]
    assert best["deviation"] < answer["deviation"]
    line = catalogue.StraightLine(150, 0.09 * 150)
    options: dict[str, Any] = {"series": ["IV*.l"], "max_size": answer["size"] * (1 + 1e-9), "rank_by": "deviation"}
    held = small.find(line, limit=1, refine=False, **options)
    assert held[0].id == best["id"]
    assert held[0].deviation == pytest.approx(best["deviation"], rel=1e-9)
    [command] = re.findall(r"search for straighter ones: catalogue (.*--rank-by\s+deviation)", words, re.DOTALL)
    done = CliRunner().invoke(app, [*shlex.split(command), "--db", str(small_db), "--format", "json", "--no-refine"])
    assert json.loads(done.stdout)[0]["id"] == best["id"]


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["1000", "abcdefg", "watt"])
def test_show_traces_no_other_named_guide(small_db: Path, reference: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    _made.cache_clear()
    monkeypatch.setattr(NamedGuide, "__post_init__", lambda design: made.append(design.name))
    CliRunner().invoke(app, ["show", reference, "--db", str(small_db)])
    assert made == [reference] * (reference == "watt")
    _made.cache_clear()


def test_two_designs_of_one_name_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "named_guides.json").write_text('[{"name": "watt"}, {"name": "watt"}]')
    monkeypatch.setattr("catalogue.series.named_guides.folder", lambda _: tmp_path)
    with pytest.raises(InvalidDesign, match="two designs have the name watt"):
        _entries.__wrapped__()


@pytest.mark.slow
def test_show_of_an_exact_guide_compares_it_with_nothing(small_db: Path) -> None:
    assert json.loads(shown(small_db, "archimedes", "--format", "json"))["design"]["best_of_series"] is None
    assert "; exact" in shown(small_db, "archimedes")


def test_each_deviation_is_the_published_one(small: catalogue.Catalogue, design: NamedGuide) -> None:
    published = as_published(design, small.guide(design.name))
    assert published.deviation == pytest.approx(design.deviation / design.stroke, rel=1e-3, abs=1e-15)
    assert published.family == design.family


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
@pytest.mark.parametrize("name", {one.family: name for name, one in ALL.items()}.values())
def test_one_of_each_family_is_shown(small: catalogue.Catalogue, small_db: Path, name: str) -> None:
    answer = json.loads(shown(small_db, name, "--format", "json"))
    assert answer["family"] == ALL[name].family
    assert answer["deviation"] == pytest.approx(as_published(ALL[name], small.guide(name)).deviation, abs=1e-15)


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_show_draws_a_design(small_db: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    shown(small_db, "roberts", "--plot", str(tmp_path / "roberts.png"))
    assert (tmp_path / "roberts.png").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_show_of_a_level_gives_the_split_guide(small_db: Path) -> None:
    answer = json.loads(shown(small_db, "watt", "--level", "-5", "--format", "json"))
    assert answer["deviation"] <= 1.01e-5
