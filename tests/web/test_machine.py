"""The page asked in any order: wishes, guides, files, comparisons; every answer is the one that is given alone."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    RuleBasedStateMachine,
    consumes,
    initialize,
    multiple,
    rule,
    run_state_machine_as_test,
)
from starlette.testclient import TestClient

import catalogue
from catalogue import StraightLine
from catalogue.export import export
from catalogue.web.application import application
from catalogue.web.cards import mechanism
from catalogue.web.desk import Thread
from catalogue.web.wish import Form

BASE = {"path": "straight-line", "stroke": "150", "deviation": "0.5", "limit": "3"}
#: Wishes that differ by what is equal, empty or nothing in Python: fields of the page, keywords of the library.
WISHES: list[tuple[dict[str, str], dict[str, Any] | None]] = [
    ({}, {}),
    ({"order": "0", "keep_out": ""}, {}),
    ({"per_series": "0"}, {"per_series": 0}),
    ({"distinct": "0"}, {"distinct": 0.0}),
    ({"family": "four-bar"}, {"families": ["four-bar"]}),
    ({"round_to": "0"}, None),  # refused, whatever was asked before
    ({"within": "0", "max_size": "-1"}, None),
]
CARD = re.compile(r'<h3>(?:<a[^>]*>)?([^<]+)(?:</a>)?</h3>.*?<p class="kind"><b>([\w.*]+)</b>', re.DOTALL)


def plain(page: str) -> str:
    """Return a page without the names of elements that are made anew for each drawing."""
    return re.sub(r"(g[0-9a-f]{8}|guide-\d+)-", "", page)


def machine(small: catalogue.Catalogue, fresh: Callable[[ExitStack], TestClient]) -> type[RuleBasedStateMachine]:
    """Return a state machine of a page, and of what the library answers to each question alone."""

    @cache
    def answers(k: int, refined: bool) -> list[Any]:
        found = small.find(StraightLine(150, 0.5, unit="mm"), limit=3, **(WISHES[k][1] or {}), refine=refined)
        return sorted(found.remember()) if refined else sorted({(mechanism(one), one.series) for one in found})

    @cache
    def alone(path: str) -> str:
        with ExitStack() as stack:
            return plain(fresh(stack).get(path).text)

    class Page(RuleBasedStateMachine):
        codes = Bundle("codes")

        def __init__(self) -> None:
            super().__init__()
            self.stack, self.refined = ExitStack(), set[str]()
            self.client = fresh(self.stack)

        @initialize(target=codes)
        def named(self) -> Any:
            return "watt"

        @rule(target=codes, k=st.integers(0, len(WISHES) - 1), refined=st.booleans())
        def wish(self, k: int, refined: bool) -> Any:
            said, asked = WISHES[k]
            stage = "refined" if refined else "draft"
            got = self.client.get("/answers", params={**BASE, **said, "stage": stage})
            if asked is None:
                assert got.status_code == 400
                return multiple()
            assert got.status_code == 200
            if refined or str(asked) in self.refined:  # refined answers are shown once they are known
                self.refined.add(str(asked))
                codes = sorted(re.findall(r'name="pick" value="(\w+)"', got.text))
                assert codes == answers(k, True)
                return multiple(*codes)
            assert sorted({*CARD.findall(got.text)}) == answers(k, False)
            return multiple()

        @rule(k=st.sampled_from([k for k, (_, asked) in enumerate(WISHES) if asked is None]))
        def refused(self, k: int) -> None:
            for stage in ("draft", "refined"):
                got = self.client.get("/answers", params={**BASE, **WISHES[k][0], "stage": stage})
                assert got.status_code == 400

        @rule(code=codes, unit=st.sampled_from(["mm", "in"]))
        def guide(self, code: str, unit: str) -> None:
            path = f"/guide/{code}?unit={unit}"
            assert plain(self.client.get(path).text) == alone(path)

        @rule(code=codes, kind=st.sampled_from(["csv", "json", "solidworks", "freecad"]))
        def file(self, code: str, kind: str) -> None:
            got = self.client.get(f"/guide/{code}/{kind}")
            if code == "watt":
                assert got.text == alone(f"/guide/{code}/{kind}")
            else:
                assert got.text == str(export(catalogue.recall(code), format=kind))

        @rule(one=codes, other=codes, unit=st.sampled_from(["mm", "in"]))
        def compare(self, one: str, other: str, unit: str) -> None:
            path = f"/compare?pick={one}&pick={other}&unit={unit}"
            assert plain(self.client.get(path).text) == alone(path)

        @rule(stroke=st.sampled_from(["0", "40", "40.0", ""]))
        def own(self, stroke: str) -> None:
            path = f"/own/measured?linkage=watt&x=0&y=0&stroke={stroke}&stage=draft"
            assert plain(self.client.get(path).text) == alone(path)

        @rule(code=consumes(codes))
        def forget(self, code: str) -> None:
            assert self.client.get(f"/guide/{code}x").status_code == 404

        def teardown(self) -> None:
            self.stack.close()

    return Page


@pytest.mark.slow
def test_a_page_answers_in_any_order_as_alone(small_db: Path, small: catalogue.Catalogue, form: Form) -> None:
    def fresh(stack: ExitStack) -> TestClient:
        page = application(small_db, form, tokens=["t"], make=Thread)
        client = stack.enter_context(TestClient(page, base_url="http://127.0.0.1"))
        client.get("/?token=t")
        return client

    run_state_machine_as_test(
        machine(small, fresh),
        settings=settings(
            max_examples=6, stateful_step_count=20, deadline=None, database=None, derandomize=True,
            suppress_health_check=[*HealthCheck],
        ),
    )  # fmt: skip
