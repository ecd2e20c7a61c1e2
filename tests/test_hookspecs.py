"""The contract and what the built-in plugins show of it cannot drift apart."""

from __future__ import annotations

import inspect
from pathlib import Path

import pluggy
import pytest

from catalogue import hookspecs
from catalogue.folders import folder
from catalogue.plugins import Registry


def hooks() -> list[str]:
    manager = pluggy.PluginManager("catalogue")
    return [name for name in dir(hookspecs) if manager.parse_hookspec_opts(hookspecs, name) is not None]


def test_there_are_hooks_and_all_are_public() -> None:
    assert {"catalogue_series", "catalogue_families"} <= set(hooks())
    assert all(name.startswith("catalogue_") for name in hooks())


@pytest.mark.parametrize("name", hooks())
def test_every_hook_says_in_one_sentence_what_to_return(name: str) -> None:
    hook = getattr(hookspecs, name)
    assert (inspect.getdoc(hook) or "").startswith("Return ")
    assert inspect.signature(hook).return_annotation is not inspect.Signature.empty


@pytest.mark.parametrize("name", hooks())
def test_every_hook_is_shown_by_a_built_in_plugin(name: str) -> None:
    shown = [
        path.name for path in folder("plugins").glob("*.py") if f"@hookimpl\ndef {name}(" in path.read_text("utf-8")
    ]
    assert shown


def test_every_built_in_plugin_with_a_hook_adds_something() -> None:
    idle = [r for r in Registry().records if not (r.series or r.families)]
    assert [r.name for r in idle if r.error or "@hookimpl" in Path(r.origin).read_text("utf-8")] == []
