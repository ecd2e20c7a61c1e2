"""SIGKILL of the command at twenty moments: the file is whole every time, and nothing is lost in the end."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.store import Database

#: Killed so long after its start; after its first new block; after the last block, while the indexes are made [s].
STARTING, FILLING, INDEXING = ("start", 5, 0.6), ("block", 10, 0.25), ("last", 5, 0.4)


def start(path: Path, environment: dict[str, str]) -> subprocess.Popen[bytes]:
    words = ["build", "--count", "2500", "--series", "T.few", "--series", "T.less", "--db", str(path)]
    return subprocess.Popen(
        [sys.executable, "-m", "catalogue", *words], env=environment, stderr=subprocess.PIPE, stdout=subprocess.PIPE
    )


def batches(path: Path) -> int:
    """Return how many batches a file holds, 0 if it has no tables yet; it is only looked at."""
    if not path.exists():
        return 0
    try:
        with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True, isolation_level=None)) as connection:
            return int(connection.execute("SELECT count(*) FROM batch").fetchone()[0])
    except sqlite3.OperationalError:
        return 0


def assert_whole(path: Path) -> None:
    with Database.open(path) as database, database.engine.connect() as connection:
        assert connection.exec_driver_sql("PRAGMA integrity_check").scalars().all() == ["ok"]
        assert connection.exec_driver_sql("PRAGMA foreign_key_check").all() == []
        counted = connection.exec_driver_sql(
            "SELECT b.kept, count(*), b.guides, sum((SELECT count(*) FROM guide g WHERE g.mechanism_id = m.id))"
            " FROM batch b JOIN mechanism m ON m.batch_id = b.id GROUP BY b.id"
        ).all()
        for kept, mechanisms, guides, found in counted:
            assert (kept, guides) == (mechanisms, found)


@pytest.mark.slow
def test_killed_at_twenty_moments_and_resumed_is_undisturbed(
    tmp_path: Path,
    environment: dict[str, str],
    content: Callable[[Path], dict[str, list[Any]]],
    all_gone: Callable[[float], None],
) -> None:
    whole, path = tmp_path / "undisturbed.db", tmp_path / "killed.db"
    with start(whole, environment) as process:
        assert process.wait(60) == 0
    last = batches(whole)
    random = np.random.default_rng(1895)
    killed = []
    for moment, times, spread in (STARTING, FILLING, INDEXING):
        for delay in random.uniform(0, spread, times):
            before = batches(path)
            wanted = {"start": 0, "block": before + 1, "last": last}[moment]
            with start(path, environment) as process:
                while batches(path) < wanted and process.poll() is None:
                    time.sleep(0.003)
                # with all blocks there, what comes before the indexes is the start
                time.sleep(0.2 + delay if before == last else 0.2 * delay if moment == "last" else delay)
                process.kill()
            killed.append(process.returncode == -signal.SIGKILL)
            assert_whole(path)
            assert batches(path) >= before
            if moment != "start":
                all_gone(5)
    assert sum(killed) >= 15  # the others had just finished
    with start(path, environment) as process:
        _, messages = process.communicate(timeout=60)
    assert process.returncode == 0, messages
    assert content(path) == content(whole)
