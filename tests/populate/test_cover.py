"""What is kept covers what was drawn: neighbours go, no cell is emptied, any beginning of the order is a cover."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.guidance.kinds import SLOTS
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.plugin.registry import Registry
from catalogue.populate.block import block
from catalogue.populate.cover import COVER, Designs, designs, order
from catalogue.populate.elements import elements_worth_tracing
from catalogue.populate.rows import guide_columns
from catalogue.series.sampling import draw

SERIES = Registry().series
MEMBERS = [("I.GG", "four-bar general"), ("II.x0", "slider-crank general"), ("IV*.l", "four-bar general")]
#: Seen from the other side, mirrored in the path, both.
POSES = np.array([(1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, 1)])


def drawn(code: str, key: str) -> tuple[Linkage, dict[str, Array], Array]:
    """Return candidates with their linkages and configurations."""
    sample = draw(SERIES[code], SERIES[code].member(key), 0, 0)
    found = elements_worth_tracing(SERIES[code], sample)
    slot = np.isin(found["kind"], list(SLOTS.values()))[:, None, None, None]
    pivots = sample.linkage.pivots[found["mechanism"]]
    names = Instant(sample.linkage, np.zeros(len(sample.linkage), complex)).configuration
    return Linkage(np.where(slot, pivots[:, :, ::-1], pivots)), found, names[found["mechanism"]]


def designed(linkage: Linkage, found: dict[str, Array]) -> Designs:
    z = found["x"] + 1j * found["y"]
    return designs(linkage, z, found["centre"], found["kind"], np.isfinite(Instant(linkage, z).curvature.rho0))


def apart(some: Array, others: Array, poses: int) -> Array:
    """Return the distances of designs from others, shape (m, n), pose by pose."""
    exchanged = others[:, [2, 3, 0, 1, 4]]
    seen = [both * sign for both in (others, exchanged) for sign in POSES[:poses]]
    cosine = np.max([np.abs(np.einsum("mpc,npc->mnp", some, one)).min(-1) for one in seen], axis=0)
    return np.asarray(np.sqrt(np.maximum(1 - cosine**2, 0)))


@pytest.fixture(scope="module", params=MEMBERS, ids=" ".join)
def lines(request: pytest.FixtureRequest) -> Designs:
    linkage, found, _ = drawn(*request.param)
    some = np.flatnonzero(found["kind"] == "line")
    return designed(linkage[some], {name: column[some] for name, column in found.items()})


@pytest.mark.slow
def test_no_two_that_are_kept_are_neighbours_and_all_others_have_one(lines: Designs) -> None:
    kept = list(order(lines, np.zeros(len(lines.kind), int)))
    assert len(set(kept)) == len(kept) < len(lines.kind)
    away = apart(lines.points, lines.points[kept], 4)
    assert away.min(axis=1).max() <= COVER.near + 1e-3
    among = away[kept] + np.eye(len(kept))
    assert among.min() > COVER.near - 1e-3


@pytest.mark.slow
def test_any_beginning_of_the_order_covers_better_than_chance(lines: Designs) -> None:
    following = list(islice(order(lines, np.zeros(len(lines.kind), int)), 64))
    random = np.random.default_rng(0)
    for count in (16, 64):
        gaps = [apart(lines.points, lines.points[following[:count]], 4).min(axis=1)]
        gaps += [
            apart(lines.points, lines.points[random.choice(len(lines.kind), count, replace=False)], 4).min(axis=1)
            for _ in range(8)
        ]
        mine, *others = (np.percentile(gap, 90) for gap in gaps)
        assert mine < 0.95 * np.mean(others)


def test_a_cell_keeps_a_member(lines: Designs) -> None:
    cells = np.arange(len(lines.kind)) % 29
    assert set(cells[list(islice(order(lines, cells), 29))]) == set(range(29))


@pytest.mark.parametrize("kind", ["line", "circle"])
def test_a_design_is_the_same_at_any_size_turned_or_with_its_dyads_exchanged(kind: str) -> None:
    linkage, found, _ = drawn("I.GG", "four-bar general")
    some = np.flatnonzero(found["kind"] == kind)[:50]
    found = {name: column[some] for name, column in found.items()}
    first = designed(linkage[some], found)
    scale = -1.7  # half a turn about the pole, and larger
    with np.errstate(invalid="ignore"):  # the centre of a line
        turned = found | {name: scale * found[name] for name in ("x", "y", "centre")}
    second = designed(Linkage(linkage[some].moved(np.array([scale]), np.array([0.0])).pivots[:, ::-1]), turned)
    away = np.diagonal(apart(first.points, second.points, 2))
    assert away.max() < 2e-3  # single precision
    assert len(np.unique(first.weight)) > 10
    np.testing.assert_allclose(second.weight, first.weight, rtol=1e-9)
    assert kind != "circle" or (first.points[:, 4, 1] >= 0).all()  # the centre lies to the left


@pytest.mark.slow
@pytest.mark.parametrize(("code", "key"), MEMBERS)
def test_no_configuration_and_kind_that_all_candidates_fill_is_empty(code: str, key: str) -> None:
    linkage, found, names = drawn(code, key)
    filled = set()
    parts = guide_columns(linkage, found | {"configuration": names})
    assert len(parts) == 2
    for guides, _ in parts:
        filled |= set(zip(guides["configuration"].tolist(), guides["kind"].tolist(), strict=True))
    made = block(SERIES[code], key, 0, 0, 60, "some", "1")
    kept = set(
        zip(np.asarray(made.mechanisms["configuration"])[made.guides["mechanism"]].tolist(), made.guides["kind"],
            strict=True)
    )  # fmt: skip
    assert kept == filled
