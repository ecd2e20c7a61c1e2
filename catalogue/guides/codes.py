"""Records of answers, their codes, and the files that keep them.

A record holds the fields of an answer to the last digit.  Its code is derived from its digest, so
an answer has one code everywhere.  The last `CODES.kept` records of a user are in one private file,
separate from any catalogue; a team may share a folder of answers beside it, see `shared`.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .. import __version__
from ..errors import InvalidRequest
from ..folders import answers_file, make_folder, replacing

if TYPE_CHECKING:
    from .shared import SharedFolder


class CodeOptions(NamedTuple):
    """Options of codes, and of the file that keeps answers."""

    kept: int = 20_000  #: number of latest records to keep: about 40 MB, and two thousand searches
    #: Length of a code [characters]: 22 * 32^6 codes; on a collision the code is one character
    #: longer.
    length: int = 7
    patience: float = 5.0  #: time to wait for another writing process [s]


CODES = CodeOptions()

#: Letters of codes, all distinct to the eye. A code begins with a letter, so it is not taken for a
#: number.
LETTERS = "abcdefghjkmnpqrstvwxyz"
DIGITS = "0123456789"
#: Application id in the SQLite header of a file of answers ("mcan"), to refuse other databases.
APPLICATION_ID = 0x6D63616E
#: Format marker of a file of answers that `save` writes.
FORMAT = "mechanism-catalogue answers"
#: Columns of the only table of a file of answers, to recognise files older than the application id.
_COLUMNS = ["number", "code", "record"]


def record(one: Any) -> dict[str, Any]:
    """Convert an answer to plain numbers, lists and strings."""
    if hasattr(one, "collection"):
        held = {"kind": "CollectionCandidate", **one.to_dict(), "metrics": dict(one.metrics)}
    else:
        held = {"kind": type(one).__name__, **{f.name: getattr(one, f.name) for f in fields(one) if f.name != "_drift"}}
    # older versions had no units, and no arcs beyond a half circle: records without these fields
    # keep their codes
    if held["unit"] is None:
        del held["unit"]
    if held.get("arc_angle", 0.0) is None:
        del held["arc_angle"]
    return held


def text_of(held: dict[str, Any]) -> str:
    """Format a record as text, whose digest gives its code."""
    return json.dumps(held, sort_keys=True, allow_nan=False)


def code_of(text: str, length: int = CODES.length) -> str:
    """Derive a code of some length from the digest of a record."""
    number = int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")
    number, first = divmod(number, len(LETTERS))
    code = LETTERS[first]
    while len(code) < length:
        number, k = divmod(number, len(LETTERS + DIGITS))
        code += (LETTERS + DIGITS)[k]
    return code


def is_code(text: str) -> bool:
    """Tell whether a text has the form of a code."""
    return len(text) >= CODES.length and text[0] in LETTERS and set(text) <= {*LETTERS, *DIGITS}


def remember(answers: Sequence[Any]) -> list[str]:
    """Store answers and return their codes.

    Raises
    ------
    InvalidRequest
        If the file of answers cannot be written; the answers remain usable.
    """
    return keep([text_of(record(one)) for one in answers])


def save(answers: Sequence[Any], path: str | Path) -> None:
    """Write answers with their request to a JSON file, for `load` on any machine.

    Raises
    ------
    InvalidRequest
        If the file cannot be written.
    """
    every = [record(one) for one in answers]
    every = [{"code": code_of(text_of(one)), **one} for one in every]
    held: dict[str, Any] = {"format": FORMAT, "version": __version__}
    if (request := getattr(answers, "request", None)) is not None:
        held["request"] = json.loads(request.to_json())
    held["answers"] = every
    path = Path(path)
    try:
        with replacing(path) as part:
            part.write(f"{json.dumps(held, indent=1, allow_nan=False)}\n".encode())
    except OSError as error:
        raise InvalidRequest(f"cannot write {path}: {error.strerror}") from None


def keep(records: Sequence[str]) -> list[str]:
    """Store records, in the shared folder too if there is one, and return their codes.

    A record stored before moves to the end of the queue.

    Raises
    ------
    InvalidRequest
        If the file of answers cannot be written, or belongs to another program; if the shared
        folder cannot be written.
    """
    codes, shared = [], _shared_folder()
    with _opened(write=True) as file:
        assert file is not None  # opened for writing
        file.execute("BEGIN IMMEDIATE")
        for text in records:
            code = _free_code(file, text, shared)
            file.execute("INSERT OR REPLACE INTO answer (code, record) VALUES (?, ?)", (code, text))
            codes.append(code)
        (held,) = file.execute("SELECT count(*) FROM answer").fetchone()
        oldest = "SELECT number FROM answer ORDER BY number LIMIT ?"
        file.execute(f"DELETE FROM answer WHERE number IN ({oldest})", (max(held - CODES.kept, 0),))  # nosec B608  # ours
        file.execute("COMMIT")
    for code, text in zip(codes, records, strict=True):
        if shared is not None:
            shared.write(code, text)
    return codes


def stored_record(code: str) -> str | bytes | None:
    """Look up the record of a code, here and in the shared folder; None if there is none.

    Raises
    ------
    InvalidRequest
        If the file of answers cannot be read, or belongs to another program; if the shared folder
        cannot be read, or holds something else under this code.
    """
    with _opened(write=False) as file:
        found = file and file.execute("SELECT record FROM answer WHERE code = ?", (code,)).fetchone()
    if found:
        return found[0] or ""
    shared = _shared_folder()
    text = shared.read(code) if shared is not None else None
    if text is not None and code_of(text, len(code)) != code:
        raise InvalidRequest(f"the shared answer {code} is damaged: its text is not the one that has this code")
    return text


def _shared_folder() -> SharedFolder | None:
    """Return the shared folder; None without one."""
    address = os.environ.get("CATALOGUE_SHARE")
    if not address:
        return None
    from .shared import SharedFolder

    return SharedFolder(address)


def _free_code(file: sqlite3.Connection, text: str, shared: SharedFolder | None) -> str:
    """Find the shortest code of a record that no other record has."""
    length = CODES.length
    while True:
        code = code_of(text, length)
        held = file.execute("SELECT record FROM answer WHERE code = ?", (code,)).fetchone()
        there = shared.read(code) if shared is not None else None
        if (held is None or held[0] == text) and there in (None, text):
            return code
        length += 1


@contextmanager
def _opened(*, write: bool) -> Iterator[sqlite3.Connection | None]:
    """Open the file of answers; None if it is missing and only to be read."""
    path: Path | str = "CATALOGUE_ANSWERS"
    try:
        path = answers_file()
        if not write and not path.exists():
            yield None
            return
        if write:
            make_folder(path.parent)
            with suppress(FileExistsError):  # SQLite would create it readable by everybody
                os.close(os.open(path.resolve(), os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600))
        with closing(sqlite3.connect(path, timeout=CODES.patience, isolation_level=None)) as file:
            if not _is_of_answers(file):
                raise InvalidRequest(
                    f"{path} is a database, but not one of answers: name another file with CATALOGUE_ANSWERS"
                )
            if write:
                _make_private(path)
                _create_table(file)
            yield file
    except (OSError, sqlite3.Error, UnicodeDecodeError) as error:  # a damaged table name raises a UnicodeDecodeError
        done = "written" if write else "read"
        raise InvalidRequest(f"the file of answers {path} cannot be {done} ({error}): {_remedy_for(error)}") from None


def _remedy_for(error: Exception) -> str:
    """Return the remedy for an error of the file of answers."""
    other = "name another with CATALOGUE_ANSWERS"
    if getattr(error, "sqlite_errorcode", 0) & 0xFF == sqlite3.SQLITE_BUSY:  # the low byte is the kind of failure
        return "try again when the other process has finished"
    return other if isinstance(error, OSError | sqlite3.OperationalError) else f"it is damaged: remove it, or {other}"


def _is_of_answers(file: sqlite3.Connection) -> bool:
    """Tell whether a database holds answers, or is empty and can hold them."""
    (mark,) = file.execute("PRAGMA application_id").fetchone()
    (version,) = file.execute("PRAGMA user_version").fetchone()
    tables = {name for (name,) in file.execute("SELECT name FROM sqlite_master WHERE sql IS NOT NULL")}
    columns = [name for _, name, *_ in file.execute("PRAGMA table_info(answer)")]
    older = tables == {"answer", "sqlite_sequence"} and columns == _COLUMNS
    return mark == APPLICATION_ID or (mark == version == 0 and (not tables or older))


def _make_private(path: Path) -> None:
    """Make the user's file of answers private, with its log and its index.

    Earlier versions created them with the permissions that the umask left.
    """
    for part in (path, *(path.with_name(path.name + suffix) for suffix in ("-wal", "-shm"))):
        with suppress(OSError):
            found = part.stat()
            if found.st_mode & 0o077 and found.st_uid == getattr(os, "getuid", lambda: None)():
                part.chmod(0o600)


def _create_table(file: sqlite3.Connection) -> None:
    """Create the table in a new file of answers, and mark the file."""
    file.execute("PRAGMA synchronous = NORMAL")
    (mark,) = file.execute("PRAGMA application_id").fetchone()
    if mark != APPLICATION_ID:
        file.execute("PRAGMA journal_mode = WAL")
        file.execute("BEGIN IMMEDIATE")
        file.execute(
            "CREATE TABLE IF NOT EXISTS answer (number INTEGER PRIMARY KEY AUTOINCREMENT, "
            "code TEXT NOT NULL UNIQUE, record TEXT NOT NULL)"
        )
        file.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        file.execute("COMMIT")
