"""Whether the files of this package are those that were installed.

An unrelated distribution, `catalogue`, has a package of this name too: each installation overwrites files of the other,
each removal takes some away.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_OURS, _OTHER = "mechanism_catalogue", "catalogue"


def is_shared() -> bool:
    """Return whether the other distribution lies beside ours."""
    return _folder(_OTHER) is not None


def is_whole() -> bool:
    """Return whether the package that was imported is ours, and the other distribution has changed no file of it."""
    imported = sys.modules.get(__name__.rpartition(".")[0])
    return hasattr(imported, "IS_COMMAND") and (not is_shared() or not _broken())


def fault() -> str:
    """Return which of the two distributions is broken and the command that mends ours; an empty text if neither is."""
    if is_whole() and not is_shared():
        return ""
    other = "the distribution `catalogue`, which owns a package of the same name"
    mend = f"`{_mending()}` mends it"
    if is_whole():
        return (
            f"{other}, is installed here and broken: `import catalogue` is mechanism-catalogue, which works; "
            f"`{_mending()}` takes it away, a virtual environment for each keeps both"
        )
    broken = _broken() or ["catalogue/__init__.py"]
    what = f"{len(broken)} of its files, {broken[0]} first," if len(broken) > 1 else f"its file {broken[0]}"
    verb = "are" if len(broken) > 1 else "is"
    cause = f"overwritten by {other}" if is_shared() else "missing or changed, as where another package was removed"
    return f"mechanism-catalogue is broken: {what} {verb} {cause}; {mend}"


def _folder(name: str) -> Path | None:
    """Return the folder of metadata of a distribution beside this package; None if there is none."""
    return next(_PACKAGE.parent.glob(f"{name}-*.*-info"), None)


def _record(name: str) -> list[str]:
    """Return the lines of the list of files of a distribution beside this package, where there is one."""
    folder = _folder(name)
    with suppress(OSError):
        return (folder / "RECORD").read_text("utf-8").splitlines() if folder else []
    return []


def _broken() -> list[str]:
    """Return the files of ours that are missing, or not as they were installed."""
    return [name for name, digest in _files() if _digest(_PACKAGE.parent / name) != digest]


def _files() -> Iterator[tuple[str, str]]:
    """Yield the files that were installed with their digests: where the other lies beside us, only those of both."""
    others = {line.rsplit(",", 2)[0] for line in _record(_OTHER)}
    for line in _record(_OURS):
        name, digest, _ = line.rsplit(",", 2)
        if digest.startswith("sha256=") and (name in others or not others):  # not of what was compiled
            yield name, digest.removeprefix("sha256=")


def _digest(file: Path) -> str:
    from base64 import urlsafe_b64encode
    from hashlib import sha256

    with suppress(OSError):
        return urlsafe_b64encode(sha256(file.read_bytes()).digest()).rstrip(b"=").decode()
    return ""


def _mending() -> str:
    """Return the command that removes the other distribution and installs ours again, from where it came."""
    import json
    from shlex import quote
    from urllib.parse import unquote

    source = "mechanism-catalogue"
    if folder := _folder(_OURS):
        with suppress(OSError, ValueError, LookupError, TypeError):  # of an index no such file tells
            came_from = json.loads((folder / "direct_url.json").read_text("utf-8"))["url"]
            source = quote(unquote(str(came_from).removeprefix("file://")))
    install = f"python -m pip install --force-reinstall --no-deps {source}"
    return f"python -m pip uninstall -y catalogue && {install}" if is_shared() else install
