"""A folder of answers that a team shares: one JSON file for each, named by its code.

A code is derived from the digest of its record: every reader can check a file, and concurrent
writers of a code write equal content.  A folder thus needs no server and no locks.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InvalidRequest, MissingExtra
from ..folders import expanded, replacing


@dataclass(frozen=True)
class SharedFolder:
    """A folder of answers.

    Attributes
    ----------
    address : str
        A path, or an address with ``://`` that fsspec opens (extra `share`).

    Raises
    ------
    InvalidRequest
        If the folder is missing, or cannot be read or written; raised by every method.
    """

    address: str

    def check(self) -> None:
        """Refuse a folder that is missing."""
        if "://" in self.address:
            self._remote()
        elif not self._path.is_dir():
            raise InvalidRequest(f"there is no folder {self.address} to share answers in: make it first")

    def read(self, code: str) -> str | None:
        """Read the record of a code; None if there is none."""
        try:
            content = self._remote_content(code) if "://" in self.address else (self._path / _name(code)).read_bytes()
            return content.decode()
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            raise self._error("read", error) from None

    def write(self, code: str, record: str) -> None:
        """Write a record under its code, unless it exists already."""
        if self.read(code) == record:
            return
        try:
            if "://" in self.address:
                system, root = self._remote()
                system.pipe_file(f"{root}/{_name(code)}", record.encode())
            else:
                self.check()
                with replacing(self._path / _name(code)) as file:
                    file.write(record.encode())
        except OSError as error:
            raise self._error("written", error) from None

    @property
    def _path(self) -> Path:
        return expanded(self.address)

    def _remote(self) -> tuple[Any, str]:
        """Return the file system of an address, and the folder in it."""
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise MissingExtra(
                'answers are shared by an address with fsspec: pip install "mechanism-catalogue[share]"'
            ) from None
        try:
            system, root = url_to_fs(self.address)
        except (ImportError, ValueError) as error:  # an unknown protocol, or one that needs another package
            raise InvalidRequest(f"answers cannot be shared in {self.address}: {error}") from None
        return system, str(root).rstrip("/")

    def _remote_content(self, code: str) -> bytes:
        system, root = self._remote()
        content: bytes = system.cat_file(f"{root}/{_name(code)}")
        return content

    def _error(self, done: str, error: Exception) -> InvalidRequest:
        told = f"the shared folder {self.address} cannot be {done} ({error})"
        return InvalidRequest(f"{told}: name another by --share or CATALOGUE_SHARE")


def _name(code: str) -> str:
    return f"{code}.json"
