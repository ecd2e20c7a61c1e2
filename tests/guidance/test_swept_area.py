"""How far links leave a region or enter a zone, against points sampled all along them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.guidance.swept_area import SWEPT_AREA, intrusion, protrusion
from catalogue.kinematics.types import Array
from catalogue.problem.region import Region

REGIONS = {
    "box": (-1.0, -0.5, 1.5, 1.0),
    "triangle": ((-1.0, -1.0), (1.5, -0.5), (0.2, 1.4)),
    "bent": ((-1.0, -1.0), (1.5, -1.0), (1.5, 0.0), (0.2, 0.1), (0.0, 1.4), (-1.0, 1.4)),
}


def sampled(region: Region, swept: Array, count: int = 401) -> Array:
    """Return how far points all along the segments lie outside, one by one, shape (n, f k count)."""
    share = np.linspace(0, 1, count)
    z = swept[..., :1] + (swept[..., 1:] - swept[..., :1]) * share
    z = np.moveaxis(z, 1, 0).reshape(swept.shape[1], -1)
    corners = region.corners @ np.array([1, 1j])
    nearest, crossings = np.full(z.shape, np.inf), np.zeros(z.shape, int)
    for a, b in zip(corners, np.roll(corners, -1), strict=True):
        side = b - a
        foot = a + side * np.clip(((z - a) / side).real, 0, 1)
        nearest = np.minimum(nearest, np.abs(z - foot))
        low, high = sorted((a, b), key=lambda w: w.imag)
        left = ((high - low).conjugate() * (z - low)).imag > 0
        crossings += (low.imag <= z.imag) & (z.imag < high.imag) & left  # a ray to the right meets this side
    return np.where(crossings % 2 == 1, -nearest, nearest)


@pytest.fixture(scope="module")
def swept() -> Array:
    """Segments of 400 linkages at 3 positions, 2 each, about as long as the regions, some far inside or outside."""
    draw = np.random.default_rng(4)
    shape = (3, 400, 2, 2)
    spread = draw.uniform(0.05, 1.2, (1, 400, 1, 1))
    ends = spread * (draw.normal(size=shape) + 1j * draw.normal(size=shape))
    shift = draw.normal(size=(1, 400, 1, 1)) + 1j * draw.normal(size=(1, 400, 1, 1))
    return np.asarray(ends + 0.6 * shift)


def each_alone(function: Callable[[Region, Array], Array], region: Region, swept: Array) -> Array:
    """Return the largest of what is found at each position, which have nothing to do with one another."""
    return np.asarray(np.max([function(region, one[None]) for one in swept], axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("name", REGIONS)
def test_protrusion_is_that_of_samples(name: str, swept: Array) -> None:
    region = Region.of(name, REGIONS[name])
    found, brute = each_alone(protrusion, region, swept), sampled(region, swept).max(1)
    clear = np.abs(brute) > 1e-3  # else a sample may miss what an edge crosses
    np.testing.assert_array_equal((found > 0)[clear], (brute > 0)[clear])
    assert 5 < (brute <= 0).sum() < 380
    _bounded(found, brute, swept)


@pytest.mark.slow
@pytest.mark.parametrize("name", REGIONS)
def test_intrusion_is_that_of_samples(name: str, swept: Array) -> None:
    region = Region.of(name, REGIONS[name])
    found, brute = each_alone(intrusion, region, swept), -sampled(region, swept).min(1)
    clear = np.abs(brute) > 1e-3
    np.testing.assert_array_equal((found > 0)[clear], (brute > 0)[clear])
    assert 5 < (brute <= 0).sum() < 380
    _bounded(found, brute, swept)


def _bounded(found: Array, brute: Array, swept: Array) -> None:
    """Assert that nothing is found that is not there, and nothing missed but between two stations."""
    size, longest = np.abs(swept).max(axis=(0, 2, 3)), np.abs(swept[..., 1] - swept[..., 0]).max(axis=(0, 2))
    # the depth changes along a segment by no more than the way along it, of which a sample misses half a step
    assert (found <= np.maximum(brute + 0.5 * longest / 400, SWEPT_AREA.grazed * size) + 1e-12).all()
    between = 0.5 * longest / (SWEPT_AREA.stations - 1)
    assert (brute <= np.maximum(found, 0) + between + 1e-12)[brute > 0].all()


@pytest.mark.parametrize("when", [-0.37, 0.0, 0.013, 0.21])
def test_what_happens_between_positions_counts(when: float) -> None:
    """A bar that rises and falls like a parabola; the positions are a tenth apart and miss its summit."""
    t = np.linspace(-1, 1, 21)
    height = 1 - (t - when) ** 2
    swept = (np.array([-0.2, 0.1]) + 1j * height[:, None])[:, None, None]
    box, zone = Region.of("box", (-2, -2, 2, 0.5)), Region.of("zone", (-1, 0.9, 1, 3.0))
    assert protrusion(box, swept) == pytest.approx(0.5, abs=1e-12)
    assert intrusion(zone, swept) == pytest.approx(0.1, abs=1e-12)
    assert protrusion(box, swept[:, [0, 0]])[1] >= height.max() - 0.5
    lost = np.where(np.arange(21)[:, None, None, None] == 4, np.nan, swept)
    assert not np.isfinite(protrusion(box, lost)).any()


def test_a_bar_across_a_zone_enters_it_though_its_stations_are_outside() -> None:
    zone = Region.of("zone", (0.0, 0.0, 0.5, 1.0))
    across, beside = np.array([-1 + 0.5j, 9 + 0.5j]), np.array([-1 + 2.5j, 9 + 2.5j])
    swept = np.stack([np.stack([across] * 5), np.stack([beside] * 5)])[None]
    assert (intrusion(zone, swept) > 0).tolist() == [True, False]
    assert intrusion(zone, swept)[1] == pytest.approx(-np.hypot(1.0, 1.5))  # of its second station


def test_a_bent_region_is_left_by_a_bar_that_cuts_its_corner() -> None:
    corner = Region.of("corner", ((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)))
    cuts, fits = np.array([0.5 + 2.9j, 2.9 + 0.5j]), np.array([0.5 + 2.9j, 0.5 + 0.5j])
    swept = np.stack([np.stack([cuts] * 5), np.stack([fits] * 5)])[None]
    assert (protrusion(corner, swept) > 0).tolist() == [True, False]
    assert protrusion(corner, swept)[0] == pytest.approx(0.7)


@pytest.mark.parametrize("poke", [0.02, 0.1, 0.3])
def test_how_deep_a_corner_is_cut_between_stations(poke: float) -> None:
    """The deepest place of the bar is on the diagonal, as far from both sides."""
    zone = Region.of("zone", (0.0, 0.0, 1.0, 1.0))
    bar: Array = np.array([30 * (1j - 1), 47 * (1 - 1j)]) + poke
    swept = np.stack([bar])[None, None]
    assert intrusion(zone, swept)[0] == pytest.approx(0.5 * poke, rel=1e-9)
