"""A collection that is dropped in keeps the contract; one that breaks it is refused in one line."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from catalogue.collections.spec import Collection, Metric, Specimen
from catalogue.errors import DuplicateSeries, PluginError, PluginWarning
from catalogue.plugin.registry import Registry
from catalogue.testing import CollectionContract

DROPIN = Path(__file__).with_name("dropin")
SWINGS = Registry([str(DROPIN)]).collection("swings")


class TestSwings(CollectionContract):
    """The drop-in."""

    collection = SWINGS


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "My Swings"}, "the name must be lower-case words with hyphens"),
        ({"name": ""}, "the name must be lower-case words with hyphens"),
        ({"title": " "}, "title, source and plan must not be blank"),
        ({"source": ""}, "title, source and plan must not be blank"),
        ({"plan": ""}, "title, source and plan must not be blank"),
        ({"families": {}}, "it needs families, and each of them series"),
        ({"families": {"pendulum": ()}}, "it needs families, and each of them series"),
        ({"metrics": {"deviation": Metric("x", "1")}}, "a metric cannot be called 'deviation'"),
        ({"metrics": {"A size": Metric("x", "1")}}, "a metric cannot be called 'A size'"),
        ({"metrics": {"size": Metric("", "1")}}, "say what the metric size means and its unit"),
        ({"metrics": {"size": "length"}}, "say what the metric size means and its unit"),
        ({"draw": None}, "draw must be a function"),
        ({"plot": "x"}, "plot must be a function"),
    ],
)
def test_a_collection_that_contradicts_itself_cannot_be_made(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(PluginError, match=message):
        replace(SWINGS, **changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"series": ""}, "family, series and configuration must not be blank"),
        ({"kind": "parabola"}, "its kind must be one of line, circle, not 'parabola'"),
        ({"deviation": math.nan}, "its deviation must be a finite number"),
        ({"deviation": -1.0}, "its deviation must be a finite number"),
        ({"metrics": {"size": math.inf}}, "size must be a finite number, not inf"),
        ({"parameters": {"a": {1}}}, "its parameters are no JSON"),
        ({"parameters": {"a": math.nan}}, "its parameters are no JSON"),
    ],
)
def test_a_specimen_that_cannot_be_stored_cannot_be_made(changes: dict[str, Any], message: str) -> None:
    good = Specimen("pendulum", "simple", "bar", "line", 0.1, {"length": 1.0}, {"size": 1.0})
    with pytest.raises(PluginError, match=message):
        replace(good, **changes)


def test_a_specimen_must_be_as_declared() -> None:
    good = Specimen("pendulum", "simple", "bar", "line", 0.1, {}, {"size": 1.0, "swing": 1.0, "sweep": 0.0})
    SWINGS.owns(good)
    with pytest.raises(PluginError, match="pendulum curtate"):
        SWINGS.owns(replace(good, series="curtate"))
    with pytest.raises(PluginError, match=r"\['sweep'\]"):
        SWINGS.owns(replace(good, metrics={"size": 1.0, "swing": 1.0}))


# -- the door ---------------------------------------------------------------------------------------------------------
@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Return a writer of plugins into one folder, which it returns."""
    monkeypatch.delenv("CATALOGUE_PLUGINS", raising=False)
    place = tmp_path / "mine"
    place.mkdir()

    def run(name: str, text: str) -> Path:
        (place / name).write_text("from catalogue.plugin import hookimpl\n" + dedent(text), "utf-8")
        return place

    return run


ASKED = """
    import sys
    @hookimpl
    def catalogue_collections():
        sys.modules["a_collection_was_asked_for"] = sys
        {body}
"""


@pytest.mark.slow
def test_the_hook_is_called_only_when_a_collection_is_asked_for(
    write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "a_collection_was_asked_for", raising=False)
    registry = Registry([str(write("late.py", ASKED.format(body="return ()")))])
    assert registry.series
    assert "a_collection_was_asked_for" not in sys.modules
    assert "swings" not in registry.collections
    assert sys.modules.pop("a_collection_was_asked_for")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("return ['x']", "PluginError: catalogue_collections returned str where Collection is wanted"),
        ("return None", "PluginError: catalogue_collections gave nothing"),
    ],
)
def test_a_broken_collection_is_a_record_and_leaves_the_others(
    write: Callable[..., Path], body: str, reason: str
) -> None:
    place = write("broken.py", ASKED.format(body=body))
    registry = Registry([str(place), str(DROPIN)])
    assert {r.error for r in registry.records} == {""}
    with pytest.warns(PluginWarning, match="plugin broken"):
        assert "swings" in registry.collections
    (record,) = [r for r in registry.records if r.name == "broken"]
    assert record.error.startswith(reason)
    assert record.collections == []


@pytest.mark.slow
def test_of_a_plugin_whose_collection_fails_nothing_counts(write: Callable[..., Path]) -> None:
    series = """
    from catalogue.series.series import Member, Series
    @hookimpl
    def catalogue_series():
        return [Series("test.1", "a test", "test.1", "nowhere", [Member("general", "four-bar", [], None)], None, None)]
    @hookimpl
    def catalogue_collections():
        raise RuntimeError("no swings")
    """
    registry = Registry([str(write("both.py", series))])
    assert "test.1" in registry.series
    with pytest.warns(PluginWarning, match="RuntimeError: no swings"):
        assert registry.collections is not None
    assert "test.1" not in registry.series


@pytest.mark.slow
def test_two_plugins_of_one_collection_are_an_error_that_names_both(write: Callable[..., Path]) -> None:
    place = write("again.py", "")
    (place / "again.py").write_text((DROPIN / "swings.py").read_text("utf-8"), "utf-8")
    with pytest.raises(DuplicateSeries, match=r"swings is claimed by two plugins, .*swings.py and .*again.py"):
        Registry([str(DROPIN), str(place)]).collections  # noqa: B018, looking is what raises


@pytest.mark.slow
def test_an_unknown_collection_is_an_error_that_lists_the_known_ones() -> None:
    registry = Registry([str(DROPIN)])
    with pytest.raises(PluginError, match=r"no plugin provides the collection gears; there are .*swings"):
        registry.collection("gears")
    assert isinstance(registry.collection("swings"), Collection)
    assert registry.provider("swings").version == "1.0"
