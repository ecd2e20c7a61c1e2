"""The contract and what the built-in plugins show of it cannot drift apart."""

from __future__ import annotations

import inspect
from pathlib import Path

import pluggy
import pytest

from catalogue.folders import folder
from catalogue.plugin import hookspecs
from catalogue.plugin.registry import Registry


def hooks() -> list[str]:
    manager = pluggy.PluginManager("catalogue")
    return [name for name in dir(hookspecs) if manager.parse_hookspec_opts(hookspecs, name) is not None]


def test_there_are_hooks_and_all_are_public() -> None:
    assert {"catalogue_series", "catalogue_families", "catalogue_collections"} <= set(hooks())
    assert all(name.startswith("catalogue_") for name in hooks())


@pytest.mark.parametrize("name", hooks())
def test_every_hook_says_in_one_sentence_what_to_return(name: str) -> None:
    hook = getattr(hookspecs, name)
    assert (inspect.getdoc(hook) or "").startswith("Return ")
    assert inspect.signature(hook).return_annotation is not inspect.Signature.empty


@pytest.mark.parametrize("name", hooks())
def test_every_hook_is_shown_by_a_plugin(name: str) -> None:
    """A built-in one, or one of the drop-ins that are tested."""
    tests = Path(__file__).parent
    files = [*folder("plugins").rglob("*.py"), *tests.glob("*/dropin/*.py")]
    assert [path.name for path in files if f"@hookimpl\ndef {name}(" in path.read_text("utf-8")]


def test_every_built_in_plugin_adds_something() -> None:
    registry = Registry()
    assert registry.collections.keys() == {name for r in registry.records for name in r.collections}
    assert [r.name for r in registry.records if not (r.series or r.families or r.collections)] == []
