"""Check the installed files of this package against their digests.

An unrelated distribution, `catalogue`, owns a package of the same name: installing either one
overwrites files of the other, removing either one deletes some.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_OURS = "mechanism_catalogue"
_OTHER = "catalogue"


def is_shared() -> bool:
    """Tell whether the other distribution is installed beside ours."""
    return _folder(_OTHER) is not None


def is_whole() -> bool:
    """Tell whether the imported package is ours and unchanged."""
    imported = sys.modules.get(__name__.rpartition(".")[0])
    return hasattr(imported, "IS_COMMAND") and (not is_shared() or not _broken_files())


def fault() -> str:
    """Name the broken distribution and the command to repair it; an empty text if both work."""
    if is_whole() and not is_shared():
        return ""
    other = "the distribution `catalogue`, which owns a package of the same name"
    mend = f"`{_repair_command()}` mends it"
    if is_whole():
        return (
            f"{other}, is installed here and broken: `import catalogue` is mechanism-catalogue, which works; "
            f"`{_repair_command()}` takes it away, a virtual environment for each keeps both"
        )
    broken = _broken_files() or ["catalogue/__init__.py"]
    what = f"{len(broken)} of its files, {broken[0]} first," if len(broken) > 1 else f"its file {broken[0]}"
    verb = "are" if len(broken) > 1 else "is"
    cause = f"overwritten by {other}" if is_shared() else "missing or changed, as where another package was removed"
    return f"mechanism-catalogue is broken: {what} {verb} {cause}; {mend}"


def _folder(name: str) -> Path | None:
    """Return the metadata folder of a distribution beside this package, or None."""
    return next(_PACKAGE.parent.glob(f"{name}-*.*-info"), None)


def _recorded_files(name: str) -> list[str]:
    """Read the installed-files record of a distribution beside this package.

    Empty if there is none.
    """
    folder = _folder(name)
    with suppress(OSError):
        return (folder / "RECORD").read_text("utf-8").splitlines() if folder else []
    return []


def _broken_files() -> list[str]:
    """List our files that are missing or changed."""
    return [name for name, digest in _files() if _digest(_PACKAGE.parent / name) != digest]


def _files() -> Iterator[tuple[str, str]]:
    """Yield our installed files with their digests.

    Only shared ones if the other distribution is installed.
    """
    others = {line.rsplit(",", 2)[0] for line in _recorded_files(_OTHER)}
    for line in _recorded_files(_OURS):
        name, digest, _ = line.rsplit(",", 2)
        if digest.startswith("sha256=") and (name in others or not others):  # compiled files have no digest
            yield name, digest.removeprefix("sha256=")


def _digest(file: Path) -> str:
    from base64 import urlsafe_b64encode
    from hashlib import sha256

    with suppress(OSError):
        return urlsafe_b64encode(sha256(file.read_bytes()).digest()).rstrip(b"=").decode()
    return ""


def _repair_command() -> str:
    """Return the command to remove the other distribution and reinstall ours from its source."""
    import json
    from shlex import quote
    from urllib.parse import unquote

    source = "mechanism-catalogue"
    if folder := _folder(_OURS):
        with suppress(OSError, ValueError, LookupError, TypeError):  # absent after installation from an index
            came_from = json.loads((folder / "direct_url.json").read_text("utf-8"))["url"]
            source = quote(unquote(str(came_from).removeprefix("file://")))
    install = f"python -m pip install --force-reinstall --no-deps {source}"
    return f"python -m pip uninstall -y catalogue && {install}" if is_shared() else install
