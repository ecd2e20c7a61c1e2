"""Codes of answers, and the file that keeps records by them: private to the user, bounded, and ours alone.

A code is made of a digest of the record, so that the same answer has the same code everywhere.
"""

from __future__ import annotations

import hashlib
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from ..errors import InvalidRequest
from ..folders import answers_file, make_folder

#: Records that the file keeps, the last ones: some 40 MB, and two thousand searches.
KEPT = 20_000
#: Letters of codes: no two look alike.  A code begins with one, so that none is a number.
LETTERS = "abcdefghjkmnpqrstvwxyz"
DIGITS = "0123456789"
#: Letters of a code; one more for as long as another answer has the same.
LENGTH = 7
#: Seconds to wait for another process that is writing.
PATIENCE = 5.0
#: What SQLite's header says of a file of answers ("mcan"), by which no other program's is taken for one.
APPLICATION_ID = 0x6D63616E
#: Columns of the one table of a file of answers, also of files written before they had the number above.
_COLUMNS = ["number", "code", "record"]


def code_of(text: str, length: int = LENGTH) -> str:
    """Return so many letters of the digest of a record."""
    number = int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")
    number, first = divmod(number, len(LETTERS))
    code = LETTERS[first]
    while len(code) < length:
        number, k = divmod(number, len(LETTERS + DIGITS))
        code += (LETTERS + DIGITS)[k]
    return code


def is_code(text: str) -> bool:
    """Return whether a text may be a code."""
    return len(text) >= LENGTH and text[0] in LETTERS and set(text) <= {*LETTERS, *DIGITS}


def keep(records: Sequence[str]) -> list[str]:
    """Keep records, and return their codes.

    A record that is kept already moves to the end of the queue and takes no second place in it.

    Raises
    ------
    InvalidRequest
        If the file of answers cannot be written, or is another program's.
    """
    codes = []
    with _opened(write=True) as file:
        assert file is not None  # what is written is made
        file.execute("BEGIN IMMEDIATE")
        for text in records:
            code = _free_code(file, text)
            file.execute("INSERT OR REPLACE INTO answer (code, record) VALUES (?, ?)", (code, text))
            codes.append(code)
        (held,) = file.execute("SELECT count(*) FROM answer").fetchone()
        oldest = "SELECT number FROM answer ORDER BY number LIMIT ?"
        file.execute(f"DELETE FROM answer WHERE number IN ({oldest})", (max(held - KEPT, 0),))  # nosec B608  # ours
        file.execute("COMMIT")
    return codes


def kept(code: str) -> str | bytes | None:
    """Return the record that a code stands for, as it is stored; None if none is kept.

    Raises
    ------
    InvalidRequest
        If the file of answers cannot be read, or is another program's.
    """
    with _opened(write=False) as file:
        found = file and file.execute("SELECT record FROM answer WHERE code = ?", (code,)).fetchone()
    return (found[0] or "") if found else None


def _free_code(file: sqlite3.Connection, text: str) -> str:
    """Return the shortest code of a record that no other one has."""
    length = LENGTH
    while True:
        code = code_of(text, length)
        held = file.execute("SELECT record FROM answer WHERE code = ?", (code,)).fetchone()
        if held is None or held[0] == text:
            return code
        length += 1


@contextmanager
def _opened(*, write: bool) -> Iterator[sqlite3.Connection | None]:
    """Open the file of answers; None if it is only to be read and is not there."""
    path: Path | str = "CATALOGUE_ANSWERS"
    try:
        path = answers_file()
        if not write and not path.exists():
            yield None
            return
        if write:
            make_folder(path.parent)
            with suppress(FileExistsError):  # SQLite would let everybody read it
                os.close(os.open(path.resolve(), os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600))
        with closing(sqlite3.connect(path, timeout=PATIENCE, isolation_level=None)) as file:
            if not _is_of_answers(file):
                raise InvalidRequest(
                    f"{path} is a database, but not one of answers: name another file with CATALOGUE_ANSWERS"
                )
            if write:
                _prepare(file)
            yield file
    except (OSError, sqlite3.Error, UnicodeDecodeError) as error:  # the last: of what SQLite says of the tables
        done = "written" if write else "read"
        raise InvalidRequest(f"the file of answers {path} cannot be {done} ({error}): {_remedy(error)}") from None


def _remedy(error: Exception) -> str:
    """Say what to do about an error of the file of answers."""
    other = "name another with CATALOGUE_ANSWERS"
    if getattr(error, "sqlite_errorcode", 0) & 0xFF == sqlite3.SQLITE_BUSY:  # the low byte is the kind
        return "try again when the other process has finished"
    return other if isinstance(error, OSError | sqlite3.OperationalError) else f"it is damaged: remove it, or {other}"


def _is_of_answers(file: sqlite3.Connection) -> bool:
    """Return whether a database is one of answers, or an empty one that may become one."""
    (mark,) = file.execute("PRAGMA application_id").fetchone()
    (version,) = file.execute("PRAGMA user_version").fetchone()
    tables = {name for (name,) in file.execute("SELECT name FROM sqlite_master WHERE sql IS NOT NULL")}
    columns = [name for _, name, *_ in file.execute("PRAGMA table_info(answer)")]
    older = tables == {"answer", "sqlite_sequence"} and columns == _COLUMNS
    return mark == APPLICATION_ID or (mark == version == 0 and (not tables or older))


def _prepare(file: sqlite3.Connection) -> None:
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
