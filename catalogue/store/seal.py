"""The digest of a file, by which a change of it is seen.

As a script, of a large file, in a process of its own.

A copy of a file in memory, as SQLite gives it, is held twice.  Who reads the file itself takes
away, when he closes it, all locks that SQLite has on it in that process (POSIX): so that is done in
another one, which needs nothing but the standard library.
"""

from __future__ import annotations

import sqlite3
import subprocess  # nosec B404
import sys
import zlib
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

#: Bytes of a file that change though nothing is changed: journal mode, counters, and the seal
#: itself.
COUNTERS = ((18, 20), (24, 28), (60, 64), (92, 100))
BLOCK = 1 << 20
#: Size from which a process of its own reads the file [bytes]: a copy in memory would take twice as
#: much.
LARGE = 1 << 27
#: What every transaction that writes does to the seal, once `is_broken` denies that it is broken.
REMOVE = "PRAGMA user_version = 0"


def digest(blocks: Iterable[bytes]) -> int:
    """Return the digest of the content of a file, which is not 0.

    The first of its blocks holds its head.
    """
    rest = iter(blocks)
    first = memoryview(next(rest, b""))
    head = bytearray(first[:100])
    for start, end in COUNTERS:
        head[start:end] = bytes(end - start)
    found = zlib.crc32(first[100:], zlib.crc32(head))
    for block in rest:
        found = zlib.crc32(block, found)
    return found - 2**31 or 1


def digest_of(path: Path) -> int:
    """Return the digest of a file that nobody writes to meanwhile."""
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection, path.open("rb") as file:
        connection.execute("BEGIN")
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()  # from here on it is locked
        return digest(iter(lambda: file.read(BLOCK), b""))


def digest_now(connection: sqlite3.Connection, path: Path) -> int:
    """Return the digest of a file as a connection sees it."""
    (mode,) = connection.execute("PRAGMA journal_mode").fetchone()
    if path.stat().st_size <= LARGE or mode == "wal":  # what is in a log is not yet in the file
        return digest([connection.serialize()])
    command = [sys.executable, "-I", __file__, str(path)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # nosec B603  # this Python, our file
    except OSError:  # no process can be started: it is read into memory
        return digest([connection.serialize()])
    if done.returncode:
        raise sqlite3.OperationalError((done.stderr.strip().splitlines() or ["its digest cannot be told"])[-1])
    return int(done.stdout)


def is_sealed(connection: sqlite3.Connection) -> bool:
    """Return whether a file has a seal."""
    return bool(connection.execute("PRAGMA user_version").fetchone()[0])


def is_broken(connection: sqlite3.Connection, path: Path) -> bool:
    """Return whether a file has a seal that is not its digest."""
    (sealed,) = connection.execute("PRAGMA user_version").fetchone()
    return bool(sealed) and sealed != digest_now(connection, path)


if __name__ == "__main__":
    print(digest_of(Path(sys.argv[1])))
