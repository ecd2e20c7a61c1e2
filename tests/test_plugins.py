"""Plugins: found in three places, isolated from one another, never guessed at."""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from textwrap import dedent

import pytest

from catalogue import __version__
from catalogue.errors import DuplicateSeries, PluginError, PluginWarning
from catalogue.folders import folder
from catalogue.foreign_code import foreign
from catalogue.plugin.registry import Record, Registry
from catalogue.progress import busy

BUILT_IN = [
    "general", "I.GG", "I.Gy", "I.yy", "II.ooo", "II*.ooo", "II.x0", "II*.x0", "II.xoy", "II*.xoy", "II.xy", "II*.xy",
    "II.y0", "II*.y0", "II.yy", "II*.yy", "III.KK", "III*.KK", "III.Kx", "III*.Kx", "IV.l", "IV*.l", "IV.x", "IV*.x",
    "parallel",
]  # fmt: skip
PLUGIN = """
    from dataclasses import replace
    from catalogue.plugin import Family, Member, Series, hookimpl

    def series(code, family="four-bar"):
        return Series(code, "a test", code, "nowhere", [Member("general", family, [], None)], None, None)

    @hookimpl
    def catalogue_series():
        return [series("{code}")]
"""
FAMILY = """
    @hookimpl
    def catalogue_families():
        return [Family("{name}", "a test", "{name}", "")]
"""
SERIES_HOOK = "@hookimpl\ndef catalogue_series():\n    "
FAMILIES_HOOK = SERIES_HOOK.replace("series", "families")
Write = Callable[..., Path]


@pytest.fixture(autouse=True)
def clean(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Leave no module of a plugin behind."""
    monkeypatch.delenv("CATALOGUE_PLUGINS", raising=False)
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if "plugin" in name:
            del sys.modules[name]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a writer of plugins: name, text, folder."""

    def run(name: str, text: str = "", code: str = "test.1", place: str = "mine") -> Path:
        path = tmp_path / place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(dedent(PLUGIN).format(code=code) + dedent(text), "utf-8")
        return path

    return run


def record(registry: Registry, name: str) -> Record:
    (found,) = [r for r in registry.records if r.name == name]
    return found


def loaded(name: str) -> list[str]:
    return [module for module in sys.modules if module.startswith(f"catalogue_plugin_{name}")]


# -- where they come from ---------------------------------------------------------------------------------------------
def test_built_in_plugins_come_through_the_same_door() -> None:
    registry = Registry()
    assert [code for code in registry.series if code in BUILT_IN] == BUILT_IN
    for code in BUILT_IN:
        provider = registry.provider(code)
        assert Path(provider.origin).parent == folder("plugins")
        assert provider.version == __version__
    assert {r.error for r in registry.records} == {""}


def test_a_named_folder_adds_its_plugins(write: Write) -> None:
    path = write("mine.py", "__version__ = '4.2'")
    registry = Registry([str(path.parent)])
    assert "test.1" in registry.series
    assert record(registry, "mine") == Record("mine", str(path), "4.2", [], ["test.1"])
    assert registry.get("test.1") is registry.series["test.1"]


def test_folders_of_the_environment_come_before_the_named_ones(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = [write("same.py", code=f"test.{place}", place=place) for place in "abc"]
    monkeypatch.setenv("CATALOGUE_PLUGINS", os.pathsep.join(str(path.parent) for path in paths[:2]))
    registry = Registry([str(paths[2].parent)])
    assert list(registry.series)[-3:] == ["test.a", "test.b", "test.c"]
    assert len(loaded("same")) == 3


def test_an_installed_package_adds_its_plugins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Write) -> None:
    write("gears_plugin.py", "__version__ = 'of the module'", place="site")
    write("belts_plugin.py", code="test.2", place="site")
    info = tmp_path / "site" / "gears-0.7.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: gears\nVersion: 0.7\n", "utf-8")
    entries = "[catalogue]\ngears = gears_plugin\nbelts = belts_plugin\nlost = no_such_plugin\nbad = gears_plugin:x\n"
    (info / "entry_points.txt").write_text(entries, "utf-8")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    with pytest.warns(PluginWarning) as caught:
        registry = Registry()
    assert {"test.1", "test.2"} <= {*registry.series}
    assert record(registry, "gears") == Record("gears", "gears", "0.7", [], ["test.1"])
    assert "No module named 'no_such_plugin'" in record(registry, "lost").error
    assert record(registry, "bad").error.startswith("AttributeError")
    assert len(caught) == 2


def test_a_package_may_import_its_submodules(write: Write) -> None:
    write("pack/__init__.py", "from .more import NUMBER\n__version__ = str(NUMBER)")
    folder = write("pack/more.py", "NUMBER = 7").parent.parent
    registry = Registry([str(folder)])
    assert record(registry, "pack").version == "7"
    assert "test.1" in registry.series


def test_files_that_begin_with_an_underscore_are_no_plugins(write: Write) -> None:
    write("_helper.py", "raise RuntimeError")
    path = write("_pack/__init__.py", "raise RuntimeError")
    assert "test.1" not in Registry([str(path.parent.parent)]).series


def test_a_folder_named_twice_counts_once(write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write("once.py")
    (tmp_path / "link").symlink_to(path.parent, target_is_directory=True)
    monkeypatch.setenv("CATALOGUE_PLUGINS", str(path.parent))
    registry = Registry([str(path.parent), str(tmp_path / "link"), str(folder("plugins"))])
    assert record(registry, "once").series == ["test.1"]


def test_a_missing_folder_is_an_error_that_says_where_it_was_named(tmp_path: Path) -> None:
    with pytest.raises(PluginError, match=r"nowhere does not exist; correct --plugins or CATALOGUE_PLUGINS"):
        Registry([str(tmp_path / "nowhere")])


def test_an_unknown_series_is_an_error_that_lists_the_known_ones() -> None:
    with pytest.raises(PluginError, match=r"no plugin provides series V\.zz; there are general, I\.GG, "):
        Registry().get("V.zz")


# -- isolation --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("def def", "SyntaxError: invalid syntax"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise ValueError('first line\\nsecond line')", "ValueError: first line"),
        ("raise KeyError", "KeyError"),
        (FAMILIES_HOOK + "raise RuntimeError('in a hook')", "RuntimeError: in a hook"),
        (FAMILIES_HOOK + "yield 1 / 0", "ZeroDivisionError: division by zero"),
        (FAMILIES_HOOK + "raise SystemExit", "SystemExit"),
        (SERIES_HOOK + "return 3", "TypeError: 'int' object is not iterable"),
        (SERIES_HOOK + "series('x')", "PluginError: catalogue_series gave nothing: mark it"),
        ("def catalogue_series():\n    return [series('x')]", "PluginError: catalogue_series gave nothing: mark it"),
        (SERIES_HOOK + "return ['x']", "PluginError: catalogue_series returned str where Series"),
        (FAMILIES_HOOK + "return [series('x')]", "PluginError: catalogue_families returned Series"),
        (SERIES_HOOK + "return [series('x', 'gear')]", "PluginError: series x is of family gear"),
        (SERIES_HOOK + "return [series('')]", "PluginError: series '': code, title and source"),
        ("@hookimpl\ndef catalogue_seires():\n    return []", "PluginValidationError: "),
        ("@hookimpl\ndef catalogue_families(request):\n    return []", "PluginValidationError: "),
    ],
)  # fmt: skip
def test_a_broken_plugin_becomes_a_record_and_leaves_the_others_alone(write: Write, text: str, reason: str) -> None:
    path = write("broken.py", text)
    write("sound.py", code="test.2")
    with pytest.warns(PluginWarning, match=r"plugin broken \(.*broken.py\) is left out: ") as caught:
        registry = Registry([str(path.parent)])
    assert len(caught) == 1
    found = record(registry, "broken")
    assert found.error.startswith(reason)
    assert (found.series, found.families) == ([], [])
    assert "test.1" not in registry.series
    assert [code for code in registry.series if code not in BUILT_IN] == ["test.2"]


@pytest.mark.slow
def test_of_a_broken_plugin_all_or_nothing_counts(write: Write) -> None:
    two = SERIES_HOOK + "yield series('test.1')\n    yield series('test.2', 'gear')"
    path = write("half.py", two)
    with pytest.warns(PluginWarning, match="half"):
        registry = Registry([str(path.parent)])
    assert list(registry.series) == list(Registry().series)


@pytest.mark.parametrize("name", ["gone.py", "gone/__init__.py"])
def test_a_plugin_that_fails_leaves_no_module_behind(write: Write, name: str) -> None:
    if "/" in name:
        write("gone/part.py")
        write(name, "from . import part\n1 / 0")
    else:
        write(name, "1 / 0")
    place = write("sound.py", code="test.2").parent
    with pytest.warns(PluginWarning, match="gone"):
        Registry([str(place)])
    assert loaded("gone") == []
    assert len(loaded("sound")) == 1


def test_a_module_is_known_by_name_before_it_runs(write: Write) -> None:
    text = """
    from __future__ import annotations
    import sys
    from dataclasses import dataclass
    from typing import ClassVar
    @dataclass
    class Thing:
        size: float
        count: ClassVar[int] = 0
    THING = Thing(2.0)
    assert sys.modules[__name__].Thing is Thing
    """
    path = write("data.py")
    path.write_text(dedent(text), "utf-8")
    registry = Registry([str(path.parent)])
    assert record(registry, "data").error == ""
    (name,) = loaded("data")
    thing = sys.modules[name].THING
    assert pickle.loads(pickle.dumps(thing)) == thing


# -- families and clashes ---------------------------------------------------------------------------------------------
def test_a_series_may_be_of_a_family_that_a_later_plugin_adds(write: Write) -> None:
    text = SERIES_HOOK + "return [series('test.1', 'geared')]"
    path = write("a_series.py", text)
    write("z_family.py", FAMILY.format(name="geared"), code="test.2")
    registry = Registry([str(path.parent)])
    assert registry.series["test.1"].families == ["geared"]
    assert registry.families["geared"].title == "a test"
    assert record(registry, "z_family").families == ["geared"]


def test_with_a_plugin_go_the_series_of_its_families_and_its_names_are_free(write: Write) -> None:
    path = write("a_series.py", SERIES_HOOK + "return [series('test.1', 'geared')]")
    write("z_family.py", FAMILY.format(name="geared") + SERIES_HOOK + "return 1 / 0")
    with pytest.warns(PluginWarning) as caught:
        registry = Registry([str(path.parent)])
    assert {str(w.message).split()[1] for w in caught} == {"a_series", "z_family"}
    assert "series test.1 is of family geared, which no plugin provides" in record(registry, "a_series").error
    assert "test.1" not in registry.series
    assert "geared" not in registry.families


def test_two_plugins_that_claim_one_series_are_an_error_that_names_both_files(write: Write) -> None:
    first, second = write("first.py"), write("second.py", place="other")
    with pytest.raises(DuplicateSeries) as caught:
        Registry([str(first.parent), str(second.parent)])
    assert str(caught.value) == f"test.1 is claimed by two plugins, {first} and {second}; remove one"


@pytest.mark.slow
def test_a_built_in_series_or_family_cannot_be_replaced(write: Write) -> None:
    path = write("mine.py", code="I.GG")
    with pytest.raises(DuplicateSeries, match=r"I\.GG is claimed by two plugins, .*i_gg\.py and .*mine\.py"):
        Registry([str(path.parent)])
    path = write("mine.py", FAMILY.format(name="oldham"))
    with pytest.raises(DuplicateSeries, match=r"oldham is claimed by two plugins, .*planar_families.*mine"):
        Registry([str(path.parent)])


@pytest.mark.slow
def test_without_threads_plugins_load_unwatched(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where Python runs in a browser, or the table of processes is full."""

    def no_thread(_: object) -> None:
        raise RuntimeError("can't start new thread")

    before = signal.getsignal(signal.SIGINT)
    expected = [*Registry().series]
    monkeypatch.setattr("threading.Thread.start", no_thread)
    registry = Registry()
    assert [record.error for record in registry.records if record.error] == []
    assert [*registry.series] == expected
    assert signal.getsignal(signal.SIGINT) is before
    with busy("nothing is shown"):
        pass
    with pytest.raises(PluginError, match="ZeroDivisionError"), foreign("a plugin"):
        1 / 0  # noqa: B018
