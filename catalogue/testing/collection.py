"""The contract of a collection, as tests that every plugin inherits."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
import pytest

from ..collections.results import CollectionCandidate
from ..collections.spec import LENGTH, Collection, Draw, Specimen
from ..problem.path import CircularArc, PathRequest, StraightLine


class OtherStroke(NamedTuple):
    """A stroke different from that of the specimens."""

    stroke: float = 250.0  #: length [length]
    close: float = 1e-3  #: relative difference permitted from the stored numbers


OTHER = OtherStroke()


class CollectionContract:
    """Tests that every collection must pass.

    To test yours: 1. subclass this with a name that begins with ``Test``; 2. set `collection`, for
    instance to ``Registry([folder]).collection("mine")``.

    Attributes
    ----------
    collection : Collection
    count : int
        Number of mechanisms of each family to sample.
    """

    collection: ClassVar[Collection]
    count: ClassVar[int] = 12

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Run each test for every family."""
        if "family" in metafunc.fixturenames:
            metafunc.parametrize("family", list(self.collection.families))

    def specimens(self, family: str) -> list[Specimen]:
        """Draw specimens of a family."""
        found = list(_draw(self.collection.draw, family, self.count))
        assert found, f"{family}: {self.count} mechanisms guide nothing"
        return found

    def test_draws_are_declared_and_repeatable(self, family: str) -> None:
        first = self.specimens(family)
        again = self.collection.draw(family, np.random.default_rng(1), self.count)
        assert [json.dumps(asdict(s)) for s in first] == [json.dumps(asdict(s)) for s in again]
        for specimen in first:
            self.collection.owns(specimen)

    def test_classes_are_those_of_the_draw(self, family: str) -> None:
        for s in self.specimens(family):
            tags = self.collection.classify(json.loads(json.dumps(dict(s.parameters))))
            assert (tags.family, tags.series, tags.configuration) == (s.family, s.series, s.configuration)

    @pytest.mark.parametrize("kind", ["line", "circle"])
    def test_what_is_stored_is_measured_again_at_any_stroke(self, family: str, kind: str) -> None:
        some = [s for s in self.specimens(family) if s.kind == kind and s.deviation <= 0.1]
        found = self.collection.measure([s.parameters for s in some], _request(kind))
        assert len(found) == len(some)
        for s, m in zip(some, found, strict=True):
            assert m.reason == ""
            assert m.deviation / OTHER.stroke == pytest.approx(s.deviation, rel=OTHER.close, abs=1e-12)
            for name, metric in self.collection.metrics.items():
                value = m.metrics[name] / (OTHER.stroke if metric.unit == LENGTH else 1)
                assert value == pytest.approx(s.metrics[name], rel=OTHER.close, abs=1e-9), name
            assert (m.radius is None) == (kind == "line")

    def test_a_given_radius_is_kept(self, family: str) -> None:
        """An arc of given radius deviates no less than one of free radius."""
        some = [s.parameters for s in self.specimens(family) if s.kind == "circle" and s.deviation <= 0.02]
        for best, one in zip(self.collection.measure(some, _request("circle")), some, strict=True):
            assert best.radius is not None
            for radius in (0.98 * best.radius, 1.05 * best.radius, 3 * best.radius):
                if 1.9 * radius < OTHER.stroke:
                    continue
                (given,) = self.collection.measure([one], CircularArc(OTHER.stroke, 0.1 * OTHER.stroke, radius))
                assert given.radius == pytest.approx(radius, rel=1e-12)
                assert given.deviation >= best.deviation * (1 - OTHER.close)

    @pytest.mark.parametrize("kind", ["line", "circle"])
    def test_what_is_laid_stays_where_it_is(self, family: str, kind: str) -> None:
        some = [s.parameters for s in self.specimens(family) if s.kind == kind and s.deviation <= 0.1]
        laid = self.collection.measure(some, _request(kind))
        again = self.collection.measure([m.parameters for m in laid], _request(kind))
        for one, other in zip(laid, again, strict=True):
            assert json.dumps(dict(one.parameters), allow_nan=False)
            assert other.deviation == pytest.approx(one.deviation, rel=OTHER.close, abs=1e-12 * OTHER.stroke)
            for a, b in zip(_flatten(one.parameters), _flatten(other.parameters), strict=True):
                assert b == pytest.approx(a, rel=1e-6, abs=1e-6 * OTHER.stroke)

    def test_nothing_is_measured_of_nothing(self) -> None:
        assert list(self.collection.measure([], _request("line"))) == []

    def test_a_piece_is_drawn(self, family: str, tmp_path: Path) -> None:
        pytest.importorskip("matplotlib")
        s = self.specimens(family)[0]
        (m,) = self.collection.measure([s.parameters], _request(s.kind))
        tags = self.collection.classify(m.parameters)
        where = tags.family, tags.series, tags.configuration, tags.special
        piece = CollectionCandidate(
            1, self.collection, *where, OTHER.stroke, m.deviation, m.radius, dict(m.metrics), m.parameters
        )
        piece.plot(tmp_path / "piece.png")
        assert (tmp_path / "piece.png").read_bytes().startswith(b"\x89PNG")


@lru_cache
def _draw(draw: Draw, family: str, count: int) -> tuple[Specimen, ...]:
    return tuple(draw(family, np.random.default_rng(1), count))


def _request(kind: str) -> PathRequest:
    return (
        StraightLine(OTHER.stroke, 0.1 * OTHER.stroke)
        if kind == "line"
        else CircularArc(OTHER.stroke, 0.1 * OTHER.stroke)
    )


def _flatten(value: object) -> list[float]:
    """Return all numbers of plain data, in order."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return [number for item in value for number in _flatten(item)]
    return [float(value)] if isinstance(value, int | float) else []
