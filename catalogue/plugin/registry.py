"""Load plugins: built-in ones, those of a user's folders, those of installed packages.

A plugin that fails to load, breaks the contract or raises in a hook becomes a `Record` with the
reason and is left out; the others are loaded.  Two plugins that claim one series or family are an
error, because no choice between them is safe.
"""

from __future__ import annotations

import importlib.util
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha1
from importlib.metadata import entry_points
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import pluggy

from .. import __version__
from ..collections.spec import Collection
from ..errors import DuplicateSeries, PluginError, PluginWarning, quoted
from ..folders import folder, is_folder, plugin_folders
from ..foreign_code import checked_text, foreign
from ..given import names
from ..kinematics.families import Family
from ..series.series import Series
from . import hookspecs
from .checks import checked

#: Largest number of families, series or collections of one plugin.
MOST = 1000

Item = TypeVar("Item", Series, Collection)


@dataclass
class Record:
    """The state of one plugin, and the names it adds."""

    name: str  # file name without suffix, or the name of the entry point
    origin: str  # file, or the package that declares the entry point
    version: str = ""  # ``__version__`` of the module, else the catalogue's for built-in plugins
    families: list[str] = field(default_factory=list)
    series: list[str] = field(default_factory=list)
    collections: list[str] = field(default_factory=list)  # names of collections, once they are loaded
    error: str = ""  # reason why the plugin was left out


class Registry:
    """The plugins of one session: their families, series and collections by name.

    `folders` are searched in addition to the built-in one and those of ``CATALOGUE_PLUGINS``.

    Raises
    ------
    DuplicateSeries
        If two plugins claim one series, family or collection.
    InvalidRequest
        If the folders are not names.
    PluginError
        If a folder does not exist.
    """

    def __init__(self, folders: Sequence[str] = ()) -> None:
        self.folders = names("plugins", folders)
        self.families: dict[str, Family] = {}
        self.series: dict[str, Series] = {}
        self._provider: dict[str, Record] = {}
        self._manager = pluggy.PluginManager("catalogue")
        self._manager.add_hookspecs(hookspecs)
        self._loaded = self._modules()
        self.records = [record for record, _ in self._loaded]
        for record, module in self._loaded:
            if module is not None:
                self._register(record, module)
        self._collect("families", Family, self.families)
        self._collect("series", Series, self.series)
        self._warn(self.records)

    @cached_property
    def collections(self) -> dict[str, Collection]:
        """The collections by name; plugins load them on first access."""
        sound = [record for record in self.records if not record.error]
        found: dict[str, Collection] = {}
        self._collect("collections", Collection, found)
        self._warn(sound)
        return found

    def collection(self, name: str) -> Collection:
        """Return a collection by its name.

        Raises
        ------
        PluginError
            If it is unknown; the message lists the known names.
        """
        return _named(name, self.collections, "the collection")

    def _warn(self, records: list[Record]) -> None:
        for record in records:
            if record.error:
                warnings.warn(f"plugin {record.name} ({record.origin}) is left out: {record.error}", PluginWarning, 4)

    def provider(self, code: str) -> Record:
        """Return the record of the plugin that provides a series, family or collection."""
        return self._provider[code]

    def get(self, code: str) -> Series:
        """Return a series by its code.

        Raises
        ------
        PluginError
            If it is unknown; the message lists the known codes.
        """
        return _named(code, self.series, "series")

    def _modules(self) -> list[tuple[Record, ModuleType | None]]:
        paths: dict[Path, Path] = {}  # resolve all paths first: an import may change the meaning of a relative path
        try:
            places = plugin_folders(self.folders)
        except OSError as error:
            raise PluginError(f"plugin folder {error.filename} cannot be used: {error.strerror}") from None
        for place in places:
            if not is_folder(place):
                raise PluginError(f"plugin folder {place} does not exist; correct --plugins or CATALOGUE_PLUGINS")
            for path in sorted([*place.glob("[!_]*.py"), *place.glob("[!_]*/__init__.py")]):
                paths.setdefault(path.resolve(), path)
        found = [_load(path) for path in paths.values()]
        for entry in sorted(entry_points(group="catalogue"), key=lambda e: e.name):
            record, module = Record(entry.name, entry.dist.name if entry.dist else entry.value), None
            try:
                with foreign(f"plugin {record.name} ({record.origin})"):
                    module = entry.load()
                    record.version = entry.dist.version if entry.dist else ""
            except PluginError as error:
                record.error = str(error)
            found.append((record, module))
        return found

    def _register(self, record: Record, module: ModuleType) -> None:
        name = f"{record.name} of {record.origin}"
        try:
            with foreign(f"plugin {name}"):
                self._manager.register(module, name)
                self._manager.check_pending()
        except PluginError as error:
            self._reject(record, str(error))

    def _collect(self, what: str, kind: type[Any], held: dict[str, Any]) -> None:
        """Collect ``families``, ``series`` or ``collections``, from each plugin all or none."""
        for record, module in self._loaded:
            if record.error:
                continue
            try:
                with foreign(f"plugin {record.name} ({record.origin})"):
                    items = self._answers(f"catalogue_{what}", kind, module, record.origin)
            except PluginError as error:
                self._reject(record, str(error))
                continue
            for name, item in items.items():
                if other := self._provider.get(name):
                    raise DuplicateSeries(
                        f"{name} is claimed by two plugins, {other.origin} and {record.origin}; remove one"
                    )
                self._provider[name], held[name] = record, item
                getattr(record, what).append(name)

    def _reject(self, record: Record, error: str) -> None:
        """Remove a plugin with its additions, and plugins whose series use its families."""
        record.error, name = error, f"{record.name} of {record.origin}"
        if self._manager.has_plugin(name):
            self._manager.unregister(name=name)
        for added, held in ((record.series, self.series), (record.families, self.families)):
            for code in added:
                del held[code], self._provider[code]
            added.clear()
        for code, one in list(self.series.items()):
            if code in self.series and (gone := [f for f in one.families if f not in self.families]):
                self._reject(self._provider[code], f"series {code} is of family {gone[0]}, which no plugin provides")

    def _answers(self, hook: str, kind: type[Any], module: ModuleType | None, origin: str) -> dict[str, Any]:
        """Return the results of one hook of one plugin, by name."""
        others = [plugin for plugin in self._manager.get_plugins() if plugin is not module]
        answers = self._manager.subset_hook_caller(hook, others)()
        if not answers and hook in dir(module):
            raise PluginError(f"{hook} gave nothing: mark it with @hookimpl and return a list")
        items: dict[str, Any] = {}
        for item in chain.from_iterable(answers):
            if not isinstance(item, kind):
                raise PluginError(f"{hook} returned {type(item).__name__} where {kind.__name__} is wanted")
            name = checked(item)
            if isinstance(item, Series) and (unknown := [f for f in item.families if f not in self.families]):
                raise PluginError(f"series {item.code} is of family {unknown[0]}, which no plugin provides")
            if name in items or len(items) == MOST:
                raise PluginError(f"{hook} returned {name} twice" if name in items else f"{hook} returned over {MOST}")
            items[name] = replace(item, origin=origin) if hasattr(item, "origin") else item
        return items


def _load(path: Path) -> tuple[Record, ModuleType | None]:
    package = path.name == "__init__.py"
    name = path.parent.name if package else path.stem
    builtin = folder("plugins").resolve() in path.resolve().parents
    record = Record(name, str(path), __version__ if builtin else "")
    where = [str(path.parent)] if package else None
    unique = f"catalogue_plugin_{name}_{sha1(str(path.resolve()).encode(), usedforsecurity=False).hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(unique, path, submodule_search_locations=where)
    assert spec is not None  # true of every file that ends in .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[unique] = module  # dataclasses and pickling look a class's module up there
    try:
        with foreign(f"plugin {name} ({path})"):
            spec.loader.exec_module(module)
            if "__version__" in vars(module):
                record.version = checked_text("__version__", vars(module)["__version__"], 40)
    except PluginError as error:
        for loaded in [key for key in sys.modules if key == unique or key.startswith(f"{unique}.")]:
            del sys.modules[loaded]
        record.error = str(error)
        return record, None
    return record, module


def _named(name: str, among: dict[str, Item], what: str) -> Item:
    if not isinstance(name, str) or name not in among:
        there = f"there are {', '.join(among)}" if among else "there are none"
        raise PluginError(f"no plugin provides {what} {name if isinstance(name, str) else quoted(name)}; {there}")
    return among[name]
