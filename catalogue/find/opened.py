"""Protocol of an open catalogue, as a search needs it."""

from __future__ import annotations

from typing import Any, Protocol

from ..guides.results import Found
from ..plugin.registry import Registry
from ..store import Database


class Opened(Protocol):
    """An open catalogue: its database, its plugins, and its search."""

    @property
    def database(self) -> Database: ...
    @property
    def registry(self) -> Registry: ...
    def find(self, *request: Any, **how: Any) -> Found: ...
