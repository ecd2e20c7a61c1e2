"""Stored reaches come in the order of what they promise, and they keep it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from sqlalchemy import func, select

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.query.conditions import basis
from catalogue.query.constraints import Constraints
from catalogue.query.find import _measured
from catalogue.query.narrow import held
from catalogue.query.promise import depth, levels, promised
from catalogue.query.ranking import price
from catalogue.query.request import Request
from catalogue.query.streams import PAGE, Streams
from catalogue.query.trail import Trail
from catalogue.store import Batch, Reach

LINES = [StraightLine(100, 100 * 10**k) for k in (-5.3, -4.0, -3.5, -2.8, -1.5)]
ARCS = [CircularArc(100, 100 / sweep, 100 * 10**k) for sweep, k in ((0.3, -3.2), (0.8, -2.5), (1.5, -4.0))]
BALANCE = {"balance": 1.0}


def everything(small: Catalogue, request: Request, wanted: Constraints, code: str) -> dict[str, np.ndarray[Any, Any]]:
    """Return all reaches of a series that may serve, by their promise."""
    promise = promised(request, wanted)
    return small.database.read(
        select(*Reach.__table__.columns, promise.label("promise"))
        .where(basis(request, wanted, levels(request, depth(wanted))), Reach.series == code)
        .order_by(promise, Reach.guide_id)
    )


def by_hand(request: Request, reach: dict[str, Any]) -> float:
    """Return what a reach promises, written out."""
    own = reach["size"] - reach["min_transmission"] / 90
    if request.sweep is None:
        decades = np.log10(request.relative)
        share = np.clip(decades - np.clip(np.floor(decades + 1e-9), -9, -2), 0, 1)
        knots = [own, reach["halfway"], reach["farther"]]
        if reach["deviation"] < 0.5 * 10.0 ** reach["level"]:
            knots[0] = min(knots[:2])
        return max(reach["floor"], float(np.polyval(np.polyfit([0, 0.5, 1], knots, 2), share)))
    size = max(1.0, reach["still"] / request.sweep + reach["grows"])
    angle = min(90.0, reach["angle"] + reach["turns"] * 2 * np.arcsin(request.sweep / 2))
    return max(reach["floor"], size - float(angle) / 90)


@pytest.mark.parametrize("request_", [*LINES, *ARCS], ids=str)
def test_sql_computes_what_is_written(small: Catalogue, request_: Any) -> None:
    found = everything(small, request_, Constraints(), "I.GG")
    some = np.arange(len(found["promise"]))[::17]
    expected = [by_hand(request_, {name: values[i] for name, values in found.items()}) for i in some]
    np.testing.assert_allclose(found["promise"][some], expected, rtol=1e-10, atol=1e-12)
    assert len(np.unique(found["guide_id"])) == len(found["guide_id"])


@pytest.mark.parametrize("request_", [*LINES, *ARCS], ids=str)
def test_promises_are_kept(small: Catalogue, request_: Any) -> None:
    off = []
    with small.database.preparing() as prepare:
        streams = Streams(prepare, request_, Constraints(), ["I.GG", "II.xy", "IV*.l"])
        for _ in range(2):
            rows = streams.read(dict.fromkeys(("I.GG", "II.xy", "IV*.l"), 2.0))
            if len(rows["id"]):
                found, good = _measured(request_, Constraints(), BALANCE, rows, Trail())
                off.append((price(found, request_, BALANCE) - rows["promise"])[good])
    if off:
        assert np.median(np.abs(np.concatenate(off))) < 0.03
        assert np.quantile(np.concatenate(off), 0.05) > -0.15


@pytest.mark.parametrize("request_", [LINES[2], ARCS[1]], ids=str)
@pytest.mark.parametrize("wish", [{}, {"min_transmission": 40}, {"fixed_pivots_in": (-200, -200, 300, 200)}], ids=str)
def test_pages_are_in_order_and_leave_nothing_out(small: Catalogue, request_: Any, wish: dict[str, Any]) -> None:
    wanted, read = Constraints(**wish), []
    everyone = everything(small, request_, wanted, "I.GG")
    everyone = {name: values[everyone["promise"] < 1.5] for name, values in everyone.items()}
    with small.database.preparing() as prepare:
        streams = Streams(prepare, request_, wanted, ["I.GG"])
        for ceiling in (0.9, 1.5):
            while True:
                rows = streams.read({"I.GG": ceiling})
                if not streams.gave:
                    break
                read.append(rows)
    assert all(a["promise"].max() <= b["promise"].min() for a, b in pairwise(read) if len(b["id"]))
    held = set(np.concatenate([rows["id"] for rows in read]).tolist())
    if not wish:
        assert held == set(everyone["guide_id"].tolist())
        assert len(read[0]["id"]) <= PAGE
        assert sum(len(rows["id"]) for rows in read) == len(held)
    else:
        assert held <= set(everyone["guide_id"].tolist())


def test_of_a_cell_the_most_promising_one_is_read(small: Catalogue) -> None:
    request_ = LINES[2]
    everyone = everything(small, request_, Constraints(), "II.ooo")
    cell = np.stack([everyone["size"] // 0.1, everyone["min_transmission"] // 12.0], axis=1)
    _, first = np.unique(cell, axis=0, return_index=True)
    expected = everyone["guide_id"][np.sort(first)]
    with small.database.preparing() as prepare:
        streams = Streams(prepare, request_, Constraints(), ["II.ooo"], distinct=0.08)
        rows = streams.read({"II.ooo": 30.0})
        order = np.lexsort((rows["id"], rows["promise"]))
        assert rows["id"][order].tolist() == expected[:PAGE].tolist()
        streams.served(1, 10)
        again = streams.read({"II.ooo": 30.0})
    assert len(again["id"]) == 2 * PAGE
    assert rows["id"][order][0] in again["id"]


def test_levels_and_promises_where_a_shorter_stroke_may_serve(small: Catalogue) -> None:
    steep = Constraints(min_transmission=40)
    assert levels(LINES[2], depth(Constraints())) == [-4]
    assert levels(LINES[2], depth(steep)) == [-4, -5, -6]
    plain, held = (everything(small, LINES[2], wanted, "I.GG") for wanted in (Constraints(), steep))
    own = held["size"] - held["min_transmission"] / 90
    assert (held["promise"] <= own + 1e-12).all()
    assert (held["promise"][held["level"] < -4] == own[held["level"] < -4]).all()
    assert set(plain["level"].tolist()) == {-4}


@pytest.mark.parametrize("request_", [LINES[2], ARCS[1]], ids=str)
def test_what_the_first_series_give_says_how_far_the_others_are_read(small: Catalogue, request_: Any) -> None:
    left_out = 0
    with small.database.preparing() as prepare:
        codes = held(lambda some: prepare(some).read(), Constraints())
        for order in (codes, codes[::-1]):
            every, some = (Streams(prepare, request_, Constraints(), codes) for _ in range(2))
            room, below = dict.fromkeys(codes, 3), dict.fromkeys(order, 2.0)
            whole, part = every.read(below), some.read(below, room, 5)
            left_out += len(set(whole["id"]) - set(part["id"]))
            best = [
                np.sort(np.concatenate([np.sort(rows["promise"][rows["series"] == code])[:3] for code in codes]))[:5]
                for rows in (whole, part)
            ]
            assert best[0].tolist() == best[1].tolist()
            rest = some.read(below)  # what was left out comes when it is asked for
            assert set(whole["id"]) <= set(part["id"]) | set(rest["id"])
    assert left_out > 10


def test_series_with_few_guides_come_first(small: Catalogue) -> None:
    held_, of = (
        small.database.read(query)
        for query in (
            select(Batch.series.label("code"), func.sum(Batch.guides).label("number")).group_by(Batch.series),
            select(Batch.series.label("code")).where(Batch.member.like("four-bar%")).distinct(),
        )
    )
    number = dict(zip(held_["code"].tolist(), held_["number"].tolist(), strict=True))
    codes = held(small.database.read, Constraints())
    assert sorted(codes) == sorted(number)
    assert [number[code] for code in codes] == sorted(number.values())
    assert set(held(small.database.read, Constraints(families=("four-bar",)))) == set(of["code"].tolist())
