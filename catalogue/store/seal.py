"""The digest of a file, which reveals a change of it.

SQLite can copy a file to memory, but holds such a copy twice. A process that reads the file itself
and closes it releases all locks that SQLite has on the file in that process (POSIX). So for a large
file this module runs as a script in a separate process, which needs nothing but the standard
library.
"""

from __future__ import annotations

import sqlite3
import subprocess  # nosec B404
import sys
import zlib
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

#: Ranges of bytes that change without a change of content: journal mode, counters, and the seal
#: itself.
COUNTERS = ((18, 20), (24, 28), (60, 64), (92, 100))
BLOCK = 1 << 20
#: Size from which a separate process reads the file [bytes]: a copy in memory would take twice as
#: much.
LARGE = 1 << 27
#: Statement by which every writing transaction removes the seal, after `is_broken` has checked it.
REMOVE = "PRAGMA user_version = 0"


def digest(blocks: Iterable[bytes]) -> int:
    """Return the digest of the content of a file, which is never 0.

    The first block holds the head of the file.
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
    """Return the digest of a file that no process writes to in the meantime."""
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection, path.open("rb") as file:
        connection.execute("BEGIN")
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()  # this locks the file for writers
        return digest(iter(lambda: file.read(BLOCK), b""))


def digest_now(connection: sqlite3.Connection, path: Path) -> int:
    """Return the digest of a file as seen by a connection."""
    (mode,) = connection.execute("PRAGMA journal_mode").fetchone()
    if path.stat().st_size <= LARGE or mode == "wal":  # the file lacks what is still in the log
        return digest([connection.serialize()])
    command = [sys.executable, "-I", __file__, str(path)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # nosec B603  # this Python, our file
    except OSError:  # no process can be started: read the file into memory
        return digest([connection.serialize()])
    if done.returncode:
        raise sqlite3.OperationalError((done.stderr.strip().splitlines() or ["its digest cannot be told"])[-1])
    return int(done.stdout)


def is_sealed(connection: sqlite3.Connection) -> bool:
    """Tell whether a file has a seal."""
    return bool(connection.execute("PRAGMA user_version").fetchone()[0])


def is_broken(connection: sqlite3.Connection, path: Path) -> bool:
    """Tell whether a file has a seal that differs from its digest."""
    (sealed,) = connection.execute("PRAGMA user_version").fetchone()
    return bool(sealed) and sealed != digest_now(connection, path)


if __name__ == "__main__":
    print(digest_of(Path(sys.argv[1])))
