"""Every page and part of one, asked well and badly; nothing but an answer or one line of what is wrong."""

from __future__ import annotations

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Coroutine
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest
from starlette.testclient import TestClient

import catalogue
from catalogue import CatalogueError, StraightLine
from catalogue.engines import Begin
from catalogue.web import asked
from catalogue.web import desk as desks
from catalogue.web.application import application
from catalogue.web.cards import mechanism
from catalogue.web.desk import Desk, Thread
from catalogue.web.own import EXAMPLE
from catalogue.web.wish import Form
from tests.curves import apart
from tests.true_curves import true_curve
from tests.web.conftest import TOKEN

WISH = {"path": "straight-line", "stroke": "150", "deviation": "0.5", "limit": "4"}


def codes(text: str) -> list[str]:
    return re.findall(r'name="pick" value="(\w+)"', text)


@pytest.fixture(scope="module")
def refined(page: TestClient) -> str:
    """Return the answers to the wish."""
    got = page.get("/answers", params={**WISH, "stage": "refined"})
    assert got.status_code == 200, got.text
    return got.text


@pytest.mark.parametrize("path", ["/", "/own", "/compare", "/static/page.css", "/static/page.js"])
def test_a_page_is_there_and_loads_nothing_from_elsewhere(page: TestClient, path: str) -> None:
    got = page.get(path)
    assert got.status_code == 200
    assert not re.search(r"""(?:src|href|url\(|import)\s*[=("']+\s*(?:https?:)?//""", got.text)
    assert "default-src 'self'" in got.headers["content-security-policy"]
    assert got.headers["x-content-type-options"] == "nosniff"
    assert "<script>" not in got.text


def test_a_database_that_is_gone_is_service_unavailable(form: Form, tmp_path: Path) -> None:
    page = application(tmp_path / "gone.db", form, tokens=[TOKEN], make=Thread)
    with TestClient(page, base_url="http://127.0.0.1") as client:
        client.get("/", params={"token": TOKEN})
        assert client.get("/answers", params=WISH).status_code == 503


def test_answers_are_those_of_find(page: TestClient, refined: str, small: catalogue.Catalogue) -> None:
    found = small.find(StraightLine(150, 0.5, unit="mm"), limit=4)
    assert len(found) == 4
    assert sorted(codes(refined)) == sorted(found.remember())
    assert 'data-refined="1"' in refined
    assert unescape(refined).count("<svg") == 4
    first = page.get("/answers", params=WISH)
    assert first.text == refined  # what is known is not searched again


def test_first_answers_are_stored_guides_and_are_not_kept(page: TestClient, small: catalogue.Catalogue) -> None:
    got = page.get("/answers", params={**WISH, "deviation": "0.4"})
    assert 'data-refined="0"' in got.text
    assert codes(got.text) == []
    found = small.find(StraightLine(150, 0.4), limit=4, refine=False)
    shown = re.findall(r'<h3>([^<]+)</h3>.*?<p class="kind"><b>([\w.*]+)</b>', got.text, re.DOTALL)
    assert sorted(shown) == sorted({(mechanism(one), one.series) for one in found})
    assert "<strong>4 guides</strong>" in got.text


def test_a_card_of_each_kind_comes_first(page: TestClient) -> None:
    got = page.get("/answers", params={**WISH, "limit": "12", "stage": "refined"})
    head, _, rest = got.text.partition("More of these kinds")
    told = re.compile(r'<h3><a[^>]*>([^<]+)</a></h3>.*?<p class="kind"><b>([\w.*]+)</b>', re.DOTALL)
    kinds = [told.findall(part) for part in (head, rest)]
    assert len(kinds[0]) == len({*kinds[0]}) > 1
    assert kinds[1]
    assert {*kinds[1]} <= {*kinds[0]}
    assert len(kinds[0]) + len(kinds[1]) == 12


@pytest.mark.slow
def test_where_no_stored_guide_serves_the_first_that_are_found_come_before_the_last(page: TestClient) -> None:
    wish = {**WISH, "deviation": "0.05", "max_size": "200", "min_transmission": "50", "limit": "2"}
    for stage, said, cards in (("draft", "No stored guide", 0), ("early", "still optimising", 2)):
        got = page.get("/answers", params={**wish, "stage": stage}).text
        assert said in got
        assert 'data-refined="0"' in got
        assert got.count("<svg") == cards
        assert codes(got) == []


@pytest.mark.slow
@pytest.mark.usefixtures("in_full")
def test_an_empty_answer_offers_links_that_give_one(page: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desks, "DESK", desks.DESK._replace(limit=600.0))  # a slow machine is not told of
    wish = {**WISH, "deviation": "0.05", "max_size": "120", "family": "four-bar", "limit": "2"}
    got = page.get("/answers", params={**wish, "stage": "refined"})
    assert got.status_code == 200
    assert "No guide found" in got.text
    links = [unescape(link) for link in re.findall(r'<li><a href="/\?([^"]+)"', got.text)]
    assert links
    assert "max size 1" in got.text.lower()
    assert "stage" not in links[0]
    again = page.get(f"/answers?{links[0]}&stage=refined")
    assert codes(again.text), again.text


def test_what_is_wrong_stands_at_its_field(page: TestClient) -> None:
    got = page.get("/", params={**WISH, "max_size": "-3"})
    assert got.status_code == 400
    assert re.search(r'id="e-max_size" role="alert">max_size must be a finite number above zero, not -3<', got.text)
    assert 'value="-3"' in got.text  # what was typed stays


def test_the_page_of_an_answer_shows_what_show_shows(page: TestClient, refined: str) -> None:
    code = codes(refined)[0]
    one = catalogue.recall(code)
    got = page.get(f"/guide/{code}", params={"unit": "in"})
    assert got.status_code == 200
    assert f"catalogue show {code}" in got.text
    assert one.series in got.text
    assert "in</span>" in got.text
    told = page.get(f"/guide/{code}/json", params={"unit": "in"}).json()
    assert told["unit"] == "in"
    inch = one.in_unit("in")
    assert (one.unit, inch.stroke) == ("mm", pytest.approx(150 / 25.4))
    assert told["pivots"] == inch.pivots
    assert told["measured"]["deviation"] == inch.deviation
    assert f"<dd>{inch.size:.4g}\u202f<span" in got.text.replace("&#8239;", "\u202f")
    assert page.get(f"/guide/{code}/json").json()["unit"] == "mm"  # its own


def test_a_page_and_its_files_have_the_unit_of_the_guide(page: TestClient) -> None:
    links = {"ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 12.5, "across": 8}
    (code,) = catalogue.guide(links, unit="in").measure(stroke=14, limit=1).remember()
    assert re.search(r"Coupler</dt><dd[^>]*>[^<]*25[^<]*<span class=\"unit\">in<", page.get(f"/guide/{code}").text)
    for more, length, unit in (("?unit=mm", 254, "mm"), ("", 10, "in")):
        told = page.get(f"/guide/{code}/solidworks{more}").text
        ((value, said),) = re.findall(r'"crank_1" = ([\d.]+)(\w+)', told)
        assert said == unit
        assert float(value) == pytest.approx(length)
    asked = {"linkage": json.dumps({**links, "unit": "in"}), "x": "", "y": "", "stroke": "304.8", "unit": "mm"}
    told = page.get("/own/measured", params=asked).json()["told"]
    assert re.search(r">254[^<]*<span class=\"unit\">mm<", told)


def test_the_motion_is_that_of_the_guide(page: TestClient, refined: str) -> None:
    code = codes(refined)[0]
    got = page.get(f"/guide/{code}/csv", params={"unit": "mm"})
    assert got.headers["content-disposition"] == f'attachment; filename="{code}.csv"'
    rows = list(csv.DictReader(io.StringIO(got.text)))
    x = np.array([float(row["guided x [mm]"]) for row in rows])
    assert (x[0], x[-1]) == pytest.approx((0, 150), abs=1.0)
    deviation = max(abs(float(row["deviation [mm]"])) for row in rows)
    assert deviation == pytest.approx(catalogue.recall(code).deviation, rel=0.05)


def test_the_drawing_is_a_file_of_its_own(page: TestClient, refined: str) -> None:
    got = page.get(f"/guide/{codes(refined)[0]}/svg")
    assert got.headers["content-type"].startswith("image/svg+xml")
    assert ET.fromstring(got.text).tag.endswith("svg")


def test_guides_stand_side_by_side(page: TestClient, refined: str) -> None:
    picked = codes(refined)[:3]
    got = page.get("/compare", params={"pick": picked})
    assert got.status_code == 200
    heads = re.findall(r'<th scope="col">.*?href="/guide/(\w+)', got.text, re.DOTALL)
    assert heads == picked
    row = re.search(r'<th scope="row"[^>]*>Deviation</th>(.*?)</tr>', got.text, re.DOTALL)
    assert row
    assert len(re.findall("<td[ >]", row[1])) == 3


def test_an_own_linkage_is_measured(page: TestClient) -> None:
    asked_ = {"linkage": EXAMPLE, "x": "0", "y": "0", "stroke": "40"}
    one = catalogue.guide(json.loads(EXAMPLE), (0, 0))
    best = one.measure(stroke=40, limit=1)[0]
    for stage in ("draft", "settled"):
        told = page.get("/own/measured", params={**asked_, "stage": stage}).json()
        path = np.array(told["path"])
        z = true_curve(one)
        assert apart(path @ [1, 1j], z) < 1e-4 * np.ptp(z.imag)
        ends = np.array(told["stretch"])[[0, -1]]
        assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(40, rel=1e-5)  # along the nominal
        shown = re.search(r"<dt>Deviation</dt><dd>([\d.]+)", told["told"])
        assert shown
        assert float(shown[1]) == pytest.approx(best.deviation, rel=5e-3)
    assert "/guide/" in told["told"]


def test_link_lengths_are_taken_too(page: TestClient) -> None:
    lengths = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80}
    got = page.get("/own/measured", params={"linkage": json.dumps(lengths), "x": "", "y": "", "stroke": "120"})
    assert got.status_code == 200
    assert re.search(r"<dt>Deviation</dt><dd>0\.485", got.json()["told"])


def test_the_page_of_an_own_linkage_leads_to_the_board(page: TestClient) -> None:
    from catalogue.guides.codes import remember

    [code] = remember([catalogue.guide(json.loads(EXAMPLE), (0, 0))])
    got = page.get(f"/guide/{code}", follow_redirects=False)
    assert got.status_code == 307
    assert got.headers["location"].startswith("/own?linkage=")
    assert page.get(f"/guide/{code}").url.path == "/own"
    assert page.get(f"/guide/{code}/csv").status_code == 404


@pytest.mark.slow
def test_the_gallery_has_every_named_guide_and_every_series(page: TestClient, small: catalogue.Catalogue) -> None:
    from catalogue.series.named_guides import named_guides

    got = page.get("/gallery")
    assert not re.search(r"""(?:src|href)=["'](?:https?:)?//""", got.text)
    text = unescape(got.text)
    for design in named_guides().values():
        assert design.title in text
        assert design.source in text
    headed = re.findall(r'<h3>(?:<a[^>]*>)?([^<]+)(?:</a>)?</h3><p class="over">([^<]+)</p>', text)
    for series in small.registry.series.values():
        assert (series.title[0].upper() + series.title[1:], series.code) in headed


BAD = [
    "",
    "x",
    "-x",
    "nan",
    "1e400",
    "[[",
    "[[[0,0],[1,1]],[[2,2],[2,2]]]",
    "{}",
    "\x00",
    "é" * 50,
    "9" * 5000,
    "[" * 1500,
]


@pytest.mark.parametrize("bad", BAD, ids=lambda text: ascii(text[:8]))
def test_bad_input_is_one_line(page: TestClient, bad: str) -> None:
    paths = [
        f"/answers?{urlencode({**WISH, 'stroke': bad})}",
        f"/?{urlencode({**WISH, 'fixed_pivots_in': bad or '1'})}",
        f"/compare?{urlencode({'pick': bad or 'x'})}",
        f"/own/measured?{urlencode({'linkage': bad, 'x': 0, 'y': 0, 'stroke': 40})}",
        f"/own?{urlencode({'linkage': EXAMPLE, 'x': bad or 'a', 'y': 0, 'stroke': 40})}",
        f"/own?{urlencode({'linkage': EXAMPLE, 'x': 0, 'y': 0, 'stroke': bad})}",
    ]
    if bad:
        paths += [f"/guide/{urlencode({'': bad})[1:]}", f"/guide/watt/{urlencode({'': bad})[1:]}"]
        paths += [f"/guide/watt/csv?{urlencode({'unit': bad})}"]
    for path in paths:
        got = page.get(path)
        assert 400 <= got.status_code < 500, (path[:80], got.status_code)
        if path.startswith("/own/measured"):
            told = got.json()["error"]
        else:
            found = re.findall(r'(?:<p class="(?:line )?error"[^>]*>|data-error=")([^<"]+)["<]', got.text)
            assert found, (path[:80], got.text[-400:])
            told = found[0]
        assert told.strip()
        assert "\n" not in told
        assert len(told) < 600


def test_too_many_side_by_side_are_refused(page: TestClient) -> None:
    got = page.get("/compare", params={"pick": [f"x{k}" for k in range(9)]})
    assert got.status_code == 400
    assert "fit side by side" in got.text


def test_files_of_the_machine_are_out_of_reach(page: TestClient, tmp_path: Path) -> None:
    secret = tmp_path / "mine.json"
    secret.write_text(EXAMPLE)
    for path in (f"/guide/{urlencode({'': str(secret)})[1:]}", "/static/..%2fapplication.py", "/static/../wish.py"):
        assert page.get(path).status_code == 404


def test_other_hosts_and_other_sites_are_refused(page: TestClient) -> None:
    assert page.get("/", headers={"host": "evil.example"}).status_code == 400
    foreign = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}
    assert page.get("/answers", params=WISH, headers=foreign).status_code == 403
    assert page.get("/", headers={**foreign, "sec-fetch-mode": "navigate"}).status_code == 403
    assert page.post("/").status_code == 405


def test_text_that_is_typed_is_no_markup(page: TestClient) -> None:
    got = page.get("/", params={**WISH, "rank_by": "<script>alert(1)</script>", "max_size": '"><b>'})
    assert "<script>alert" not in got.text
    assert "><b>" not in got.text


def test_the_database_is_only_read(small_db: Path, tmp_path: Path) -> None:
    from catalogue.store import Database

    before = small_db.stat().st_mtime_ns
    with Database.open(small_db, writable=False) as database:
        assert len(database.plain({"id": int}, "FROM guide LIMIT 3")["id"]) == 3
        with pytest.raises(CatalogueError, match="may not be written"), database.begin() as connection:
            connection.exec_driver_sql("DELETE FROM reach")
    assert small_db.stat().st_mtime_ns == before
    with pytest.raises(CatalogueError, match="does not exist"):
        Database.open(tmp_path / "none.db", writable=False)
    assert not (tmp_path / "none.db").exists()


def _slow(started: list[int], seconds: float) -> str:
    import time

    started.append(1)
    time.sleep(seconds)
    return "answer"


async def _never() -> bool:
    return False


async def _at_once() -> bool:
    return True


def in_a_loop(task: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine in a thread of its own: the browser's tests may have left a loop running in this one."""
    import asyncio
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, task).result()


def in_threads(test: Callable[[Desk], object]) -> None:
    async def run() -> None:
        desk = Desk(Begin(int), Thread)
        try:
            await test(desk)  # type: ignore[misc]  # an async function
        finally:
            await desk.close()

    in_a_loop(run())


def test_one_question_asked_twice_is_answered_once() -> None:
    import asyncio

    async def test(desk: Desk) -> None:
        started: list[int] = []
        asks = [desk.ask("same", desk.quick, _never, _slow, started, 0.05) for _ in range(5)]
        assert await asyncio.gather(*asks) == ["answer"] * 5
        assert await desk.ask("same", desk.quick, _never, _slow, started, 0.05) == "answer"
        assert len(started) == 1
        assert desk.knows("same")

    in_threads(test)


def test_a_question_that_nobody_waits_for_is_never_begun() -> None:
    import asyncio

    from catalogue.web.desk import NobodyWaits

    async def test(desk: Desk) -> None:
        busy = [asyncio.create_task(desk.ask(f"busy {k}", desk.quick, _never, _slow, [], 0.4))
                for k in range(desk.quick.count)]  # fmt: skip
        await asyncio.sleep(0.05)
        started: list[int] = []
        with pytest.raises(NobodyWaits):
            await desk.ask("dropped", desk.quick, _at_once, _slow, started, 0.0)
        await asyncio.gather(*busy)
        await asyncio.sleep(0.05)
        assert not started
        assert await desk.ask("dropped", desk.quick, _never, _slow, started, 0.0) == "answer"

    in_threads(test)


def test_what_fails_is_told_and_asked_again_the_next_time() -> None:
    async def test(desk: Desk) -> None:
        with pytest.raises(ZeroDivisionError):
            await desk.ask("wrong", desk.quick, _never, divmod, 1, 0)
        assert not desk.knows("wrong")
        assert await desk.ask("wrong", desk.quick, _never, divmod, 7, 2) == (3, 1)

    in_threads(test)


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, -1])
def test_a_wish_has_the_same_answer_before_and_after_another(
    small_db: Path, form: Form, small: catalogue.Catalogue, order: int
) -> None:
    base = {**WISH, "limit": "8", "stage": "refined"}
    wishes = [base, {**base, "per_series": "0"}, {**base, "round_to": "0"}, {**base, "distinct": "0"}]
    with TestClient(application(small_db, form, tokens=[TOKEN], make=Thread), base_url="http://127.0.0.1") as client:
        client.get("/", params={"token": TOKEN})
        got = [client.get("/answers", params=wish) for wish in wishes[::order]][::order]
    assert [one.status_code for one in got] == [200, 200, 400, 200]
    plain, unbound, _, close = ([*codes(one.text)] for one in got)
    for found, options in ((plain, {}), (unbound, {"per_series": 0}), (close, {"distinct": 0.0})):
        alone = small.find(StraightLine(150, 0.5, unit="mm"), limit=8, **options)
        assert sorted(found) == sorted(alone.remember())
    assert len({*map(str, (plain, unbound, close))}) >= 2


def test_a_question_that_takes_too_long_is_ended_and_others_get_their_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    import asyncio
    import time

    monkeypatch.setattr(desks, "DESK", desks.DESK._replace(limit=0.2))

    async def test(desk: Desk) -> None:
        start = time.monotonic()
        slow = [asyncio.create_task(desk.ask(f"slow {k}", desk.quick, _never, _slow, [], 3.0))
                for k in range(desk.quick.count)]  # fmt: skip
        await asyncio.sleep(0.05)
        assert await desk.ask("other", desk.quick, _never, _slow, [], 0.0) == "answer"
        assert time.monotonic() - start < 1.5
        for one in slow:
            with pytest.raises(desks.Busy, match="takes longer than"):
                await one
        assert not desk.knows("slow 0")

    in_threads(test)


def test_questions_beyond_those_that_can_wait_are_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    import asyncio

    from catalogue.web import desk as desks

    monkeypatch.setattr(desks, "DESK", desks.DESK._replace(max_waiting=3))

    async def test(desk: Desk) -> None:
        many = [asyncio.create_task(desk.ask(k, desk.quick, _never, _slow, [], 0.2))
                for k in range(desk.quick.count + 4)]  # fmt: skip
        found = await asyncio.gather(*many, return_exceptions=True)
        refused = [one for one in found if isinstance(one, desks.Busy)]
        assert len(refused) == 1
        assert "are waiting already" in str(refused[0])
        assert found.count("answer") == desk.quick.count + 3

    in_threads(test)


def test_slow_questions_leave_quick_ones_alone() -> None:
    import asyncio
    import time

    async def test(desk: Desk) -> None:
        slow = [asyncio.create_task(desk.ask(f"slow {k}", desk.thorough, _never, _slow, [], 0.5)) for k in range(6)]
        await asyncio.sleep(0.05)
        start = time.monotonic()
        await desk.ask("quick", desk.quick, _never, _slow, [], 0.0)
        assert not any(one.done() for one in slow)
        assert time.monotonic() - start < 0.45
        await asyncio.gather(*slow)

    in_threads(test)


@pytest.mark.slow
def test_workers_that_are_killed_are_begun_anew(small_db: Path) -> None:
    import os
    import signal

    from catalogue.web.desk import process

    async def run() -> None:
        desk = Desk(asked.begin(small_db, ()), process)
        try:
            pid = await desk.ask("pid", desk.quick, _never, os.getpid)
            assert pid != os.getpid()
            os.kill(pid, signal.SIGKILL)
            other = await desk.ask("pid again", desk.quick, _never, os.getpid)
            assert other not in (pid, os.getpid())
        finally:
            await desk.close()

    in_a_loop(run())
